#include "tools/print/units.hpp"

#include <gtest/gtest.h>

#include "base/text/times.hpp"
#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::print {
namespace {

using recording::tests::at;
using namespace std::chrono_literals;

TEST(Units, WriteTimesInUtcWithMicroseconds) {
  EXPECT_EQ(time_text(at(1.5)), "2026-03-01T07:00:00.001500Z");
  EXPECT_EQ(clock_text(at(1.5)), "07:00:00.001500Z");
  EXPECT_EQ(time_text({}), "-");
}

TEST(Units, WriteDurationsWithThreeDigits) {
  EXPECT_EQ(duration_text(0ns), "0 ns");
  EXPECT_EQ(duration_text(999ns), "999 ns");
  EXPECT_EQ(duration_text(1234ns), "1.23 us");
  EXPECT_EQ(duration_text(45600us), "45.6 ms");
  EXPECT_EQ(duration_text(-3ms), "-3.00 ms");
  EXPECT_EQ(duration_text(59s), "59.0 s");
  EXPECT_EQ(duration_text(90s), "1m30s");
  EXPECT_EQ(duration_text(-117s), "-1m57s");
}

TEST(Units, WriteAgesInWholeSecondsWithTwoUnits) {
  EXPECT_EQ(age_text(0ns), "0s");
  EXPECT_EQ(age_text(59'999ms), "59s");
  EXPECT_EQ(age_text(117s), "1m57s");
  EXPECT_EQ(age_text(125min), "2h05m");
  EXPECT_EQ(age_text(76h), "3d04h");
}

TEST(Units, WriteSizes) {
  EXPECT_EQ(size_text(1023), "1023 B");
  EXPECT_EQ(size_text(1536), "1.5 KiB");
  EXPECT_EQ(size_text(1ULL << 30U), "1.00 GiB");
}

TEST(Units, WriteTimesThatAreReadAgain) {
  EXPECT_EQ(base::text::parse_time(time_text(at(12.345)), {}), at(12.345));
}

TEST(Units, ReadSizes) {
  EXPECT_EQ(parse_size("500"), 500U);
  EXPECT_EQ(parse_size("64KiB"), 65536U);
  EXPECT_EQ(parse_size("1.5M"), 1500000U);
  EXPECT_EQ(parse_size("1MB"), 1'000'000U);
  EXPECT_EQ(parse_size("1 GB"), 1'000'000'000U);
  EXPECT_EQ(parse_size("1Mi"), 1'048'576U);
  EXPECT_FALSE(parse_size("10 cm"));
  EXPECT_FALSE(parse_size("1mb")) << "a millibit";
}

}  // namespace
}  // namespace millrace::tools::print
