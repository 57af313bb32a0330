#include "fabric/log_limiter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

const SteadyTime start{1h};

TEST(LogLimiter, LogsOnceAndThenCounts) {
  LogLimiter sut;
  EXPECT_EQ(sut.admit("forged", "a", "first", start), "first");
  for (int i = 0; i < 20'000; ++i) {
    EXPECT_EQ(sut.admit("forged", "a", "again", start + 1s), std::nullopt);
  }
  EXPECT_EQ(sut.admit("forged", "b", "other", start + 1s), "other");
  EXPECT_THAT(sut.due(start + 59s), IsEmpty());
  EXPECT_THAT(sut.due(start + 60s), ElementsAre("again (and 19999 more like this in 60 s)"));
  EXPECT_THAT(sut.due(start + 61s), IsEmpty());
}

TEST(LogLimiter, LogsAgainAfterAMinuteAlsoWithoutATimer) {
  LogLimiter sut;
  static_cast<void>(sut.admit("forged", "a", "first", start));
  EXPECT_EQ(sut.admit("forged", "a", "second", start + 59s), std::nullopt);
  EXPECT_EQ(sut.admit("forged", "a", "third", start + 60s), "third (and 1 more like this before)");
  EXPECT_EQ(sut.admit("forged", "a", "fourth", start + 61s), std::nullopt);
}

// A stranger with 64 writers would silence the logs about later ones.
TEST(LogLimiter, HasRoomForNewKindsOnceOthersAreOver) {
  LogLimiter sut;
  for (std::size_t i = 0; i < LogLimiter::most_kinds; ++i) {
    static_cast<void>(sut.admit("kind", std::to_string(i), "text", start));
  }
  static_cast<void>(sut.admit("kind", "x", "one too many", start));
  EXPECT_EQ(sut.admit("kind", "y", "two too many", start + 60s),
            "two too many; problems of more kinds are only counted");
  EXPECT_EQ(sut.admit("forged", "later", "another one", start + 120s), "another one");
}

TEST(LogLimiter, LogsAMessageAsNewAfterALongPause) {
  LogLimiter sut;
  static_cast<void>(sut.admit("forged", "a", "first", start));
  EXPECT_THAT(sut.due(start + 60s), IsEmpty());
  EXPECT_EQ(sut.admit("forged", "a", "again", start + 61s), "again");
}

TEST(LogLimiter, CountsTooManyKindsTogether) {
  LogLimiter sut;
  for (std::size_t i = 0; i < LogLimiter::most_kinds; ++i) {
    EXPECT_TRUE(sut.admit("kind", std::to_string(i), "text", start));
  }
  EXPECT_EQ(sut.admit("kind", "x", "one too many", start),
            "one too many; problems of more kinds are only counted");
  EXPECT_EQ(sut.admit("kind", "y", "two too many", start), std::nullopt);
  EXPECT_THAT(sut.due(start + 60s), ElementsAre("1 problems of other kinds in 60 s"));
}

TEST(Throttle, AdmitsALimitedNumberInAWindowAndCountsTheOthers) {
  Throttle sut(3, 10s);
  int admitted = 0;
  for (int i = 0; i < 10; ++i) {
    admitted += sut.admit(start + 1s) ? 1 : 0;
  }
  EXPECT_EQ(admitted, 3);
  EXPECT_EQ(sut.due(start + 2s), std::nullopt);
  EXPECT_EQ(sut.due(start + 11s), 7U);
  EXPECT_EQ(sut.due(start + 12s), std::nullopt);
  EXPECT_TRUE(sut.admit(start + 12s));
  EXPECT_EQ(sut.due(start + 30s), std::nullopt) << "all of them were counted";
}

}  // namespace
}  // namespace millrace::fabric
