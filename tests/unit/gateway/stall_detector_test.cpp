#include "gateway/machines/stall_detector.hpp"

#include <gtest/gtest.h>

namespace millrace::gateway {
namespace {

using namespace std::chrono_literals;

constexpr SteadyTime begin{1000s};

class PulseTest : public testing::Test {
 protected:
  machines::StallDetector sut{400ms};
};

TEST_F(PulseTest, BeatsEightTimesALease) {
  EXPECT_EQ(sut.beat(begin), begin + 50ms);
}

TEST_F(PulseTest, ForgivesHalfALease) {
  const SteadyTime due = sut.beat(begin);
  EXPECT_FALSE(sut.late(begin + 200ms));
  EXPECT_EQ(sut.late(begin + 201ms), begin + 201ms - due);
}

TEST_F(PulseTest, TellsEachStandstillOnce) {
  const SteadyTime due = sut.beat(begin);
  EXPECT_EQ(sut.late(due + 5s), 5s);
  EXPECT_FALSE(sut.late(due + 5s));
  EXPECT_EQ(sut.late(due + 5s + 1s), 1s);
}

TEST_F(PulseTest, IsNotLateBeforeItBeats) {
  EXPECT_FALSE(sut.late(begin));
}

}  // namespace
}  // namespace millrace::gateway
