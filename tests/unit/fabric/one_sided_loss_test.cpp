#include "fabric/one_sided_loss.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

using namespace std::chrono_literals;
using testing::Eq;
using testing::Optional;

class OneSidedLossTest : public testing::Test {
 protected:
  void authenticate(OneSidedLoss::Handle handle, const std::string& prefix) {
    sut.on_authenticated(handle, {.guid_prefix = prefix, .name = "square-root"});
  }
  /// Once a second, as in operation; returns what the last check found.
  std::optional<std::string> announce(const std::set<std::string>& prefixes,
                                      std::chrono::seconds how_long) {
    std::optional<std::string> found;
    for (const auto end = now + how_long; now < end;) {
      found = sut.find(now += 1s, prefixes);
    }
    return found;
  }

  OneSidedLoss::Clock::time_point now{};
  OneSidedLoss sut{30s};
};

TEST_F(OneSidedLossTest, IsAnAnnouncedParticipantThatWasLostAndDoesNotAuthenticateItselfAgain) {
  authenticate(1, "a:1:1");
  EXPECT_EQ(announce({"a:1:1"}, 60s), std::nullopt) << "it is authenticated";
  sut.on_lost(1);
  EXPECT_EQ(announce({}, 60s), std::nullopt) << "it is not announced";
  EXPECT_EQ(announce({"a:1:1"}, 31s), std::nullopt) << "its handshake may take so long";
  EXPECT_THAT(announce({"a:1:1"}, 1s), Optional(Eq("square-root")));
  EXPECT_THAT(announce({"a:1:1"}, 1s), Optional(Eq("square-root"))) << "until the process ends";
}

TEST_F(OneSidedLossTest, IsNotOneThatAuthenticatesItselfAgain) {
  authenticate(1, "a:1:1");
  sut.on_lost(1);
  EXPECT_EQ(announce({"a:1:1"}, 20s), std::nullopt);
  authenticate(2, "a:1:1");
  EXPECT_EQ(announce({"a:1:1"}, 60s), std::nullopt);
  EXPECT_FALSE(sut.any());
  sut.on_lost(2);
  EXPECT_TRUE(sut.any());
  EXPECT_EQ(announce({"a:1:1"}, 31s), std::nullopt) << "the time counts from the last loss";
  EXPECT_THAT(announce({"a:1:1"}, 1s), Optional(Eq("square-root")));
}

TEST_F(OneSidedLossTest, IsNotAStranger) {
  authenticate(1, "a:1:1");
  sut.on_lost(1);
  EXPECT_EQ(announce({"b:1:1"}, 60s), std::nullopt);
}

TEST_F(OneSidedLossTest, IsNotOneWhoseAnnouncementsEnd) {
  authenticate(1, "a:1:1");
  sut.on_lost(1);
  EXPECT_EQ(announce({"a:1:1"}, 20s), std::nullopt);
  EXPECT_EQ(announce({}, 1s), std::nullopt);
  EXPECT_EQ(announce({"a:1:1"}, 31s), std::nullopt);
}

// Its thread could not answer a handshake either.
TEST_F(OneSidedLossTest, CountsNoTimeInWhichThisProcessStoodStill) {
  authenticate(1, "a:1:1");
  sut.on_lost(1);
  EXPECT_EQ(announce({"a:1:1"}, 20s), std::nullopt);
  now += 60s;
  EXPECT_EQ(announce({"a:1:1"}, 31s), std::nullopt);
  EXPECT_THAT(announce({"a:1:1"}, 1s), Optional(Eq("square-root")));
}

TEST_F(OneSidedLossTest, RemembersTheLatestOfManyThatAreLost) {
  authenticate(1, "a:1:1");
  sut.on_lost(1);
  for (OneSidedLoss::Handle handle = 2; handle < 2 + OneSidedLoss::most_lost; ++handle) {
    authenticate(handle, "b:1:" + std::to_string(handle));
    sut.on_lost(handle);
  }
  EXPECT_EQ(announce({"a:1:1"}, 60s), std::nullopt);
  EXPECT_THAT(announce({"b:1:2"}, 60s), Optional(Eq("square-root")));
}

}  // namespace
}  // namespace millrace::fabric
