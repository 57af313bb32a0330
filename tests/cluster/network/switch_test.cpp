#include "tests/cluster/network/switch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::tests::cluster {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using std::chrono_literals::operator""ms;

const std::string broadcast = "\xff\xff\xff\xff\xff\xff";
const std::string ann = std::string("\x02\x00\x00\x00\x00\x0a", 6);
const std::string bob = std::string("\x02\x00\x00\x00\x00\x0b", 6);

std::string frame(const std::string& to, const std::string& from) {
  return to + from + "\x08" + std::string(50, '.');
}

std::vector<std::size_t> ports(const std::vector<Delivery>& frames) {
  std::vector<std::size_t> result;
  for (const Delivery& each : frames) {
    result.push_back(each.port);
  }
  return result;
}

class SwitchTest : public testing::Test {
 protected:
  Switch sut{3, 1};
  Switch::Time now{};
};

TEST_F(SwitchTest, SendsABroadcastFrameToAllOtherPorts) {
  sut.take(1, frame(broadcast, ann), now);
  EXPECT_THAT(ports(sut.due(now)), ElementsAre(0, 2));
}

TEST_F(SwitchTest, SendsAFrameOnlyWhereItsDestinationWasSeen) {
  sut.take(2, frame(broadcast, bob), now);
  sut.due(now);
  sut.take(0, frame(bob, ann), now);
  EXPECT_THAT(ports(sut.due(now)), ElementsAre(2));
}

TEST_F(SwitchTest, CutsOneDirectionOnly) {
  sut.way(0, 1).cut = true;
  sut.take(0, frame(broadcast, ann), now);
  EXPECT_THAT(ports(sut.due(now)), ElementsAre(2));
  sut.take(1, frame(broadcast, bob), now);
  EXPECT_THAT(ports(sut.due(now)), ElementsAre(0, 2));
}

TEST_F(SwitchTest, DropsMulticastFramesWhereMulticastIsOff) {
  const std::string group = std::string("\x01\x00\x5e\x7f\x00\x01", 6);
  sut.way(0, 1).multicast = false;
  sut.take(0, frame(group, ann), now);
  EXPECT_THAT(ports(sut.due(now)), ElementsAre(2));
  sut.take(0, frame(broadcast, ann), now);
  EXPECT_THAT(ports(sut.due(now)), ElementsAre(1, 2));
}

TEST_F(SwitchTest, LosesTheConfiguredShareOfTheFrames) {
  sut.way(0, 1).loss = 0.1;
  for (int i = 0; i < 10'000; ++i) {
    sut.take(0, frame(broadcast, ann), now);
  }
  EXPECT_NEAR(static_cast<double>(sut.counters().lost), 1000, 100);
}

TEST_F(SwitchTest, DelaysFramesWithinTheJitterAndReordersThem) {
  sut.way(0, 1).delay = 20ms;
  sut.way(0, 1).jitter = 10ms;
  sut.way(0, 2).cut = true;
  for (char i = 0; i < 100; ++i) {
    sut.take(0, frame(broadcast, ann) + i, now);
  }
  EXPECT_THAT(sut.due(now + 9ms), IsEmpty());
  ASSERT_TRUE(sut.next());
  EXPECT_GE(*sut.next(), now + 10ms);
  std::string order;
  for (const Delivery& each : sut.due(now + 30ms)) {
    order += each.frame.back();
  }
  EXPECT_EQ(order.size(), 100);
  EXPECT_FALSE(std::is_sorted(order.begin(), order.end()));
  EXPECT_FALSE(sut.next());
}

TEST_F(SwitchTest, DecidesTheSameForTheSameSeed) {
  const auto lost = [this](std::uint64_t seed) {
    Switch other(2, seed);
    other.way(0, 1).loss = 0.5;
    std::string pattern;
    for (int i = 0; i < 64; ++i) {
      other.take(0, frame(broadcast, ann), now);
      pattern += other.due(now).empty() ? '-' : '+';
    }
    return pattern;
  };
  EXPECT_EQ(lost(7), lost(7));
  EXPECT_NE(lost(7), lost(8));
}

TEST_F(SwitchTest, IgnoresFramesThatAreTooShort) {
  sut.take(0, "short", now);
  EXPECT_THAT(sut.due(now), IsEmpty());
}

}  // namespace
}  // namespace millrace::tests::cluster
