#include "tools/print/units.hpp"

#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::print {
namespace {

using recording::tests::at;
using namespace std::chrono_literals;

TEST(Units, WriteTimesInUtcWithMicroseconds) {
  EXPECT_EQ(time_text(at(1.5)), "2026-03-01T07:00:00.001500Z");
  EXPECT_EQ(clock_text(at(1.5)), "07:00:00.001500");
  EXPECT_EQ(time_text({}), "-");
}

TEST(Units, WriteDurationsWithThreeDigits) {
  EXPECT_EQ(duration_text(0ns), "0 ns");
  EXPECT_EQ(duration_text(999ns), "999 ns");
  EXPECT_EQ(duration_text(1234ns), "1.23 us");
  EXPECT_EQ(duration_text(45600us), "45.6 ms");
  EXPECT_EQ(duration_text(-3ms), "-3.00 ms");
  EXPECT_EQ(duration_text(90s), "90.0 s");
  EXPECT_EQ(duration_text(125min), "2 h 5 min");
}

TEST(Units, WriteSizes) {
  EXPECT_EQ(size_text(1023), "1023 B");
  EXPECT_EQ(size_text(1536), "1.5 KiB");
  EXPECT_EQ(size_text(1ULL << 30U), "1.00 GiB");
}

TEST(Units, ReadTimes) {
  EXPECT_EQ(parse_time("2026-03-01T07:00:00Z"), at(0));
  EXPECT_EQ(parse_time("2026-03-01T07:00:00.0015Z"), at(1.5));
  EXPECT_EQ(parse_time(time_text(at(12.345))), at(12.345));
}

class NoTime : public testing::TestWithParam<const char*> {};

TEST_P(NoTime, IsRefusedWithWhatWasExpected) {
  const auto time = parse_time(GetParam());
  ASSERT_FALSE(time);
  EXPECT_NE(time.error().find("2026-03-01T07:00:00Z"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Units, NoTime,
                         testing::Values("", "yesterday", "2026-03-01", "2026-02-30T07:00:00Z",
                                         "2026-03-01T24:00:00Z", "2026-03-01T07:00:00",
                                         "2026-03-01T07:00:00Zz", "2026-3-1T07:00:00Z",
                                         "2026-03-01T07:00:00.123456789123Z"));

TEST(Units, ReadDurations) {
  EXPECT_EQ(parse_duration("250ms"), 250ms);
  EXPECT_EQ(parse_duration("1.5 s"), 1500ms);
  EXPECT_EQ(parse_duration("30"), 30s);
  EXPECT_EQ(parse_duration("2h"), 2h);
  EXPECT_FALSE(parse_duration("-1s"));
  EXPECT_FALSE(parse_duration("10 years"));
  EXPECT_FALSE(parse_duration("1e30s"));
  EXPECT_FALSE(parse_duration(""));
}

TEST(Units, ReadSizes) {
  EXPECT_EQ(parse_size("500"), 500U);
  EXPECT_EQ(parse_size("64KiB"), 65536U);
  EXPECT_EQ(parse_size("1.5M"), 1500000U);
  EXPECT_FALSE(parse_size("10 cm"));
}

}  // namespace
}  // namespace millrace::tools::print
