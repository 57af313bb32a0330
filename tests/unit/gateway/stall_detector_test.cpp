#include "gateway/machines/stall_detector.hpp"

#include <gtest/gtest.h>

namespace millrace::gateway {
namespace {

using namespace std::chrono_literals;

constexpr SteadyTime begin{1000s};

class StallDetectorTest : public testing::Test {
 protected:
  machines::StallDetector sut{400ms};
};

TEST_F(StallDetectorTest, SendsEightHeartbeatsALease) {
  EXPECT_EQ(sut.heartbeat(begin), begin + 50ms);
}

TEST_F(StallDetectorTest, ToleratesHalfALease) {
  const SteadyTime due = sut.heartbeat(begin);
  EXPECT_FALSE(sut.take_overdue(begin + 200ms));
  EXPECT_EQ(sut.take_overdue(begin + 201ms), begin + 201ms - due);
}

TEST_F(StallDetectorTest, ReportsEachStandstillOnce) {
  const SteadyTime due = sut.heartbeat(begin);
  EXPECT_EQ(sut.take_overdue(due + 5s), 5s);
  EXPECT_FALSE(sut.take_overdue(due + 5s));
  EXPECT_EQ(sut.take_overdue(due + 5s + 1s), 1s);
}

TEST_F(StallDetectorTest, IsNotLateBeforeItsHeartbeat) {
  EXPECT_FALSE(sut.take_overdue(begin));
}

}  // namespace
}  // namespace millrace::gateway
