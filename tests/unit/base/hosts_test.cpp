#include "base/loop/hosts.hpp"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace millrace::base::loop {
namespace {

using Waiting = std::vector<std::shared_ptr<std::string>>;

Waiting waiting(const std::vector<std::string>& addresses) {
  Waiting all;
  for (const std::string& address : addresses) {
    all.push_back(std::make_shared<std::string>(address));
  }
  return all;
}

std::ptrdiff_t place_of_most_dispensable(const Waiting& all) {
  const auto found = most_dispensable(all, [](const std::string& address) { return address; });
  return std::ranges::find(all, found) - all.begin();
}

TEST(MostDispensable, IsTheFirstOfTheHostThatHasMost) {
  EXPECT_EQ(place_of_most_dispensable(waiting({"10.0.0.1", "10.0.0.2", "10.0.0.2"})), 1);
}

TEST(MostDispensable, IsTheFirstOfAllIfNoHostHasMore) {
  EXPECT_EQ(place_of_most_dispensable(waiting({"10.0.0.3", "10.0.0.2", "10.0.0.3", "10.0.0.2"})),
            0);
}

TEST(MostDispensable, OfAnIpv6HostCountsItsWholeNetwork) {
  EXPECT_EQ(place_of_most_dispensable(
                waiting({"fd00:0:0:1::1", "fd00:0:0:2::1", "fd00:0:0:2::2", "10.0.0.1"})),
            1);
}

TEST(MostDispensable, IsNothingOfNothing) {
  EXPECT_EQ(most_dispensable(Waiting(), [](const std::string& address) { return address; }),
            nullptr);
}

TEST(AHost, HasOneIpv4AddressOrAnIpv6Network) {
  EXPECT_EQ(host_of("192.168.0.7"), "192.168.0.7");
  EXPECT_EQ(host_of("2001:db8:0:1:a:b:c:d"), "2001:db8:0:1::");
  EXPECT_EQ(host_of("::ffff:10.0.0.1"), "::ffff:10.0.0.1");
  EXPECT_EQ(host_of("unknown address"), "unknown address");
}

}  // namespace
}  // namespace millrace::base::loop
