#include "tools/doctor/clock.hpp"

#include <gtest/gtest.h>

namespace millrace::tools::doctor {
namespace {

using std::chrono_literals::operator""ms;

fabric::Time at(std::chrono::nanoseconds time) {
  return fabric::Time(std::chrono::hours(1)) + time;
}

TEST(AClockComparison, AssumesTheAnswerInTheMiddleOfTheExchange) {
  ClockComparison sut;
  sut.add({at(0ms), at(5004ms), at(8ms)});
  ASSERT_TRUE(sut.result());
  EXPECT_EQ(sut.result()->ahead, 5000ms);
  EXPECT_EQ(sut.result()->error, 4ms);
}

TEST(AClockComparison, IsRightWithinItsErrorWhateverTheDelays) {
  for (const auto out : {0ms, 3ms, 10ms}) {  // Of a round trip of 10 ms.
    ClockComparison sut;
    sut.add({at(0ms), at(out - 700ms), at(10ms)});
    EXPECT_LE(std::chrono::abs(sut.result()->ahead + 700ms), sut.result()->error);
  }
}

TEST(AClockComparison, TrustsTheShortestExchange) {
  ClockComparison sut;
  sut.add({at(0ms), at(150ms), at(100ms)});
  sut.add({at(200ms), at(301ms), at(202ms)});
  sut.add({at(400ms), at(450ms), at(500ms)});
  EXPECT_EQ(sut.result()->ahead, 100ms);
  EXPECT_EQ(sut.result()->error, 1ms);
}

TEST(AClockComparison, HasNoResultBeforeAnAnswerWithATime) {
  ClockComparison sut;
  sut.add({at(0ms), fabric::Time{}, at(8ms)});
  sut.add({at(8ms), at(4ms), at(0ms)});
  EXPECT_FALSE(sut.result());
}

}  // namespace
}  // namespace millrace::tools::doctor
