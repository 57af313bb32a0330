#include "base/program/repeats.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/loop/clock_watch.hpp"
#include "base/recent.hpp"

namespace millrace::base::program {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;

Repeats::Time at(std::chrono::seconds offset) {
  return Repeats::Time(1h + offset);
}

TEST(Repeats, ReportsAFaultOnceAndThenAtGrowingIntervalsWithACount) {
  Repeats sut;
  std::vector<std::string> lines;
  for (auto second = 0s; second <= 80s; ++second) {
    if (const auto line = sut.note("write", "disk full", at(second))) {
      lines.push_back(*line);
    }
  }
  EXPECT_THAT(lines, ElementsAre("disk full", "disk full (10 times in 10 s)",
                                 "disk full (20 times in 20 s)", "disk full (40 times in 40 s)"));
}

TEST(Repeats, ReportsAFaultAtLeastOnceAnHour) {
  Repeats sut;
  auto last_report = at(0s);
  for (auto second = 0s; second <= 24h; second += 5s) {
    if (sut.note("write", "disk full", at(second))) {
      EXPECT_LE(at(second) - last_report, 1h);
      last_report = at(second);
    }
  }
  EXPECT_GT(last_report, at(22h));
}

TEST(Repeats, CountsAgainAfterTheFaultWasOver) {
  Repeats sut;
  EXPECT_TRUE(sut.note("write", "disk full", at(0s)));
  EXPECT_FALSE(sut.note("write", "disk full", at(1s)));
  EXPECT_EQ(sut.over("write"), 2U);
  EXPECT_EQ(sut.over("write"), 0U);
  EXPECT_EQ(sut.note("write", "disk full", at(2s)), "disk full");
}

TEST(Repeats, ReportsAFaultAsNewAfterALongPause) {
  Repeats sut;
  EXPECT_TRUE(sut.note("write", "disk full", at(0s)));
  EXPECT_EQ(sut.note("write", "disk full", at(301s)), "disk full");
}

TEST(Repeats, SeparatesALimitedNumberOfKinds) {
  Repeats sut;
  EXPECT_TRUE(sut.note("write", "disk full", at(0s)));
  EXPECT_TRUE(sut.note("read", "no such file", at(0s)));
  for (std::size_t kind = 0; kind < Repeats::most_kinds; ++kind) {
    EXPECT_TRUE(sut.note(std::to_string(kind), "x", at(1s)));
  }
  EXPECT_EQ(sut.over("write"), 0U);
}

}  // namespace
}  // namespace millrace::base::program

namespace millrace::base {
namespace {

TEST(Recent, ForgetsTheEntryThatWasUnusedForLongest) {
  Recent<int, std::string> sut(2);
  EXPECT_FALSE(sut.put(1, "one"));
  EXPECT_FALSE(sut.put(2, "two"));
  EXPECT_EQ(*sut.use(1), "one");
  const auto displaced = sut.put(3, "three");
  ASSERT_TRUE(displaced);
  EXPECT_EQ(displaced->value, "two");
  EXPECT_EQ(sut.newest(), "three");
  EXPECT_FALSE(sut.put(1, "another one"));
  EXPECT_EQ(sut.put(4)->key, 3);
  EXPECT_EQ(*sut.find(1), "another one");
}

TEST(Recent, FindsWithoutMakingAnEntryNewer) {
  Recent<int, int, std::hash<int>> sut(2);
  sut.put(1);
  sut.put(2);
  EXPECT_NE(sut.find(1), nullptr);
  EXPECT_EQ(sut.put(3)->key, 1);
  EXPECT_EQ(sut.find(1), nullptr);
}

TEST(Recent, HasRoomForAnotherEntryAfterOneWasErased) {
  Recent<int> sut(2);
  sut.put(1);
  sut.put(2);
  sut.erase(1);
  EXPECT_FALSE(sut.put(3));
  sut.erase_if([](const auto& entry) { return entry.key == 3; });
  EXPECT_EQ(sut.size(), 1U);
  EXPECT_EQ(sut.begin()->key, 2);
}

}  // namespace
}  // namespace millrace::base

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
