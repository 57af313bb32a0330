#include "tools/web/actions/sessions.hpp"

#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace millrace::tools::web::actions {
namespace {

using namespace std::chrono_literals;

class AThrottle : public testing::Test {
 protected:
  /// Whether a password may be tried now.
  bool may_try(const std::string& user, const std::string& address) {
    return sut.try_now({user, address}, now).count() == 0;
  }
  /// The number of these tries that are allowed at once.
  template <typename Who>
  int allowed(int tries, Who who) {
    int count = 0;
    for (int i = 0; i < tries; ++i) {
      const auto [user, address] = who(i);
      count += may_try(user, address) ? 1 : 0;
    }
    return count;
  }
  Throttle sut;
  fabric::SteadyTime now{1h};
};

// A regression: with 1,000 other names the attacker made the throttle forget the user whose
// password was to be guessed.
TEST_F(AThrottle, LimitsAnAddressThatTriesManyNamesAndForgetsNoneOfThem) {
  EXPECT_EQ(allowed(10, [](int) { return std::pair("anna", "10.0.0.1"); }), Throttle::free_tries);
  const int with_other_names =
      allowed(5000, [](int i) { return std::pair(fmt::format("name {}", i), "10.0.0.1"); });
  EXPECT_LE(with_other_names, Throttle::free_tries_of_address);
  EXPECT_FALSE(may_try("anna", "10.0.0.1"));
}

TEST_F(AThrottle, DoesNotForgetAFailureWhenManyAddressesFillIt) {
  EXPECT_EQ(allowed(10, [](int) { return std::pair("anna", "10.0.0.1"); }), Throttle::free_tries);
  const int filled = allowed(
      5000, [](int i) { return std::pair("x", fmt::format("10.1.{}.{}", i / 250, i % 250)); });
  EXPECT_LE(static_cast<std::size_t>(filled), Throttle::most_names / 2);
  EXPECT_FALSE(may_try("anna", "10.0.0.1"));
  EXPECT_FALSE(may_try("berta", "10.9.9.9")) << "full, so new names wait";
  now += Throttle::remembered;
  EXPECT_TRUE(may_try("berta", "10.9.9.9"));
}

TEST_F(AThrottle, CountsTheAddressesOfOneIpv6NetworkTogether) {
  const int tries = allowed(
      200, [](int i) { return std::pair(fmt::format("u{}", i), fmt::format("fd00::{:x}", i)); });
  EXPECT_LE(tries, Throttle::free_tries_of_address);
  EXPECT_TRUE(may_try("anna", "fd00:0:0:1::1"));
}

TEST_F(AThrottle, LeavesTheUsersOfAnAddressAloneWhoKnowTheirPasswords) {
  for (int i = 0; i < 1000; ++i) {
    const Throttle::Who who{fmt::format("user {}", i % 50), "10.0.0.1"};
    ASSERT_EQ(sut.try_now(who, now).count(), 0) << i;
    sut.succeeded(who);
  }
}

TEST_F(AThrottle, DoublesThePauseUpToAMinute) {
  allowed(Throttle::free_tries, [](int) { return std::pair("anna", "10.0.0.1"); });
  for (const auto pause : {1s, 2s, 4s, 8s, 16s, 32s, 60s, 60s}) {
    EXPECT_EQ(sut.try_now({"anna", "10.0.0.1"}, now), pause);
    EXPECT_FALSE(may_try("anna", "10.0.0.1"));
    EXPECT_TRUE(may_try("anna", fmt::format("10.2.0.{}", pause.count()))) << "elsewhere she may";
    now += pause;
    EXPECT_TRUE(may_try("anna", "10.0.0.1"));
  }
}

}  // namespace
}  // namespace millrace::tools::web::actions
