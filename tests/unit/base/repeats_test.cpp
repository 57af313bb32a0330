#include "base/program/repeats.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
  auto said = at(0s);
  for (auto second = 0s; second <= 24h; second += 5s) {
    if (sut.note("write", "disk full", at(second))) {
      EXPECT_LE(at(second) - said, 1h);
      said = at(second);
    }
  }
  EXPECT_GT(said, at(22h));
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
