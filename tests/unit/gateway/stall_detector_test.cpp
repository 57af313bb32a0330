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

TEST_F(PulseTest, BeatsFourTimesALease) {
  EXPECT_EQ(sut.beat(begin), begin + 100ms);
}

TEST_F(PulseTest, ForgivesAQuarterOfALease) {
  const SteadyTime due = sut.beat(begin);
  EXPECT_FALSE(sut.late(due + 100ms));
  EXPECT_EQ(sut.late(due + 101ms), 101ms);
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
