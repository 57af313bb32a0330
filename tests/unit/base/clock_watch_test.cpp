#include "base/loop/clock_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::base::loop {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

const std::chrono::sys_time<std::chrono::nanoseconds> start{1772352000s};

/// `steady` after the start by the steady clock, and `ahead` more by the wall clock.
Clocks at(std::chrono::hours steady, std::chrono::hours ahead = 0h) {
  return {std::chrono::steady_clock::time_point() + steady, start + steady + ahead};
}

TEST(AClockWatch, AcceptsAClockThatFollowsElapsedTime) {
  ClockWatch sut("files", start - 24h, at(0h));
  for (int hour = 0; hour < 10'000; hour += 10) {
    EXPECT_TRUE(sut.believes(at(std::chrono::hours(hour))));
  }
  EXPECT_EQ(sut.news(), std::nullopt);
}

TEST(AClockWatch, RejectsAClockThatJumpsAheadForADayAndReportsItOnce) {
  ClockWatch sut("files", start, at(0h));
  EXPECT_FALSE(sut.believes(at(1h, 8760h)));
  EXPECT_THAT(sut.news().value_or(""), HasSubstr("jumped ahead by 8760 hours"));
  EXPECT_FALSE(sut.believes(at(24h, 8760h)));
  EXPECT_EQ(sut.news(), std::nullopt);
  EXPECT_TRUE(sut.believes(at(25h, 8760h)));
}

TEST(AClockWatch, AcceptsACorrectedClock) {
  ClockWatch sut("files", start, at(0h));
  EXPECT_FALSE(sut.believes(at(1h, 8760h)));
  EXPECT_TRUE(sut.believes(at(2h)));
}

TEST(AClockWatch, RejectsAClockThatMakesEverythingVeryOld) {
  ClockWatch sut("files", start - 31 * 24h, at(0h));
  EXPECT_FALSE(sut.believes(at(1h)));
  EXPECT_THAT(sut.news().value_or(""), HasSubstr("files were last written 31 days ago"));
  EXPECT_TRUE(ClockWatch("files", std::nullopt, at(0h)).believes(at(1h)));
}

}  // namespace
}  // namespace millrace::base::loop
