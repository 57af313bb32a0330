#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "tools/recording/statistics.hpp"

namespace millrace::tools::recording {
namespace {

using std::chrono::nanoseconds;

TEST(Histogram, IsZeroWithoutValues) {
  const Histogram sut;
  EXPECT_EQ(sut.count(), 0U);
  EXPECT_EQ(sut.percentile(0.99), nanoseconds{});
  EXPECT_EQ(sut.mean(), nanoseconds{});
}

TEST(Histogram, KeepsSmallValuesExactly) {
  Histogram sut;
  for (int value = 1; value <= 50; ++value) {
    sut.add(nanoseconds(value));
  }
  EXPECT_EQ(sut.percentile(0.5), nanoseconds(25));
  EXPECT_EQ(sut.percentile(1), nanoseconds(50));
  EXPECT_EQ(sut.mean(), nanoseconds(26));  // 25.5, rounded
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

TEST(Histogram, AddsUp) {
  Histogram sut;
  sut.add(nanoseconds(10));
  Histogram other;
  other.add(nanoseconds(1000));
  sut.add(other);
  EXPECT_EQ(sut.count(), 2U);
  EXPECT_EQ(sut.max(), nanoseconds(1000));
  EXPECT_EQ(sut.percentile(0.5), nanoseconds(10));
}

}  // namespace
}  // namespace millrace::tools::recording
