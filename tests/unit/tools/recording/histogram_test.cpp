#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/recording/statistics.hpp"

namespace millrace::tools::recording {
namespace {

using std::chrono::nanoseconds;
using std::chrono_literals::operator""ms;
using tests::at;

TEST(Histogram, IsZeroWithoutValues) {
  const Histogram sut;
  EXPECT_EQ(sut.count(), 0U);
  EXPECT_EQ(sut.percentile(0.99), nanoseconds{});
}

TEST(Histogram, KeepsSmallValuesExactly) {
  Histogram sut;
  for (int value = 1; value <= 50; ++value) {
    sut.add(nanoseconds(value));
  }
  EXPECT_EQ(sut.percentile(0.5), nanoseconds(25));
  EXPECT_EQ(sut.percentile(1), nanoseconds(50));
}

TEST(Histogram, FindsPercentilesWithinTwoPercent) {
  Histogram sut;
  std::mt19937_64 random(1);
  std::vector<std::int64_t> values;
  for (int i = 0; i < 100000; ++i) {
    values.push_back(
        static_cast<std::int64_t>(std::exp2(std::uniform_real_distribution<>(3, 36)(random))));
    sut.add(nanoseconds(values.back()));
  }
  std::sort(values.begin(), values.end());
  for (const double share : {0.01, 0.5, 0.9, 0.99, 0.999}) {
    const auto index = static_cast<std::size_t>(std::ceil(share * 100000)) - 1;
    const auto exact = static_cast<double>(values[index]);
    EXPECT_NEAR(static_cast<double>(sut.percentile(share).count()), exact, exact / 64 + 1) << share;
  }
  EXPECT_EQ(sut.max(), nanoseconds(values.back()));
}

TEST(Histogram, CountsATimeThatRunsBackwardsAsZero) {
  Histogram sut;
  sut.add(nanoseconds(-5));
  EXPECT_EQ(sut.count(), 1U);
  EXPECT_EQ(sut.percentile(1), nanoseconds{});
}

TEST(Histogram, AcceptsTheLargestValue) {
  Histogram sut;
  sut.add(nanoseconds::max());
  EXPECT_EQ(sut.percentile(0.5), nanoseconds::max());
}

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
