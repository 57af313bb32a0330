#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/recording/statistics.hpp"

namespace millrace::tools::recording {
namespace {

using std::chrono_literals::operator""ms;
using tests::at;

TEST(ARate, IsZeroBeforeAnythingHappened) {
  const Rate sut;
  EXPECT_EQ(sut.per_second(at(0)), 0);
  EXPECT_EQ(sut.mean(at(0)), std::nullopt);
}

TEST(ARate, CountsOverTheTimeSinceTheFirst) {
  Rate sut;
  for (int i = 0; i < 20; ++i) {
    sut.add(at(i * 100), 5ms);
  }
  EXPECT_NEAR(sut.per_second(at(2000)), 10, 0.1);
  EXPECT_EQ(sut.mean(at(2000)), 5ms);
}

TEST(ARate, OfABurstIsNotMoreThanTheBurst) {
  Rate sut;
  sut.add(at(0), 1ms);
  sut.add(at(1), 1ms);
  EXPECT_EQ(sut.per_second(at(1)), 2);
}

TEST(ARate, ForgetsWhatIsOlderThanTheWindow) {
  Rate sut;
  sut.add(at(0), 1ms);
  sut.add(at(9'000), 3ms);
  EXPECT_NEAR(sut.per_second(at(10'500)), 0.1, 0.001);
  EXPECT_EQ(sut.mean(at(10'500)), 3ms);
  EXPECT_EQ(sut.per_second(at(60'000)), 0);
  EXPECT_EQ(sut.count(), 2U);
}

TEST(ARate, HasNoMeanOfUnknownDurations) {
  Rate sut;
  sut.add(at(0), std::nullopt);
  EXPECT_EQ(sut.mean(at(0)), std::nullopt);
  sut.add(at(1), 4ms);
  EXPECT_EQ(sut.mean(at(1)), 4ms);
}

}  // namespace
}  // namespace millrace::tools::recording
