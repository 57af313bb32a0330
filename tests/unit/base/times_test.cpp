#include "base/text/times.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::base::text {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

const Time morning = std::chrono::sys_days(std::chrono::year(2026) / 3 / 1) + 7h;

TEST(TimeSpan, IsANumberAndAUnit) {
  EXPECT_EQ(parse_time_span("5ns"), 5ns);
  EXPECT_EQ(parse_time_span("5us"), 5us);
  EXPECT_EQ(parse_time_span("250ms"), 250ms);
  EXPECT_EQ(parse_time_span("1.5 s"), 1500ms);
  EXPECT_EQ(parse_time_span("15m"), 15min);
  EXPECT_EQ(parse_time_span("15min"), 15min);
  EXPECT_EQ(parse_time_span("2h"), 2h);
  EXPECT_EQ(parse_time_span("7d"), 168h);
}

TEST(TimeSpan, IsSecondsWithoutAUnit) {
  EXPECT_EQ(parse_time_span("30"), 30s);
}

class NoTimeSpan : public testing::TestWithParam<const char*> {};

TEST_P(NoTimeSpan, IsRefusedWithWhatWasExpected) {
  EXPECT_THAT(parse_time_span(GetParam()).error(), HasSubstr("expected a number with ns, us, ms"));
}

INSTANTIATE_TEST_SUITE_P(Texts, NoTimeSpan,
                         testing::Values("", "d", "-1s", "10 years", "1e30s", "nan", "inf", "1 s s",
                                         "5 S"));

TEST(TimeText, IsAPointInUtc) {
  EXPECT_EQ(parse_time("2026-03-01", {}), morning - 7h);
  EXPECT_EQ(parse_time("2026-03-01T07:00", {}), morning);
  EXPECT_EQ(parse_time("2026-03-01T07:00:00", {}), morning);
  EXPECT_EQ(parse_time("2026-03-01T07:00:00Z", {}), morning);
  EXPECT_EQ(parse_time("2026-03-01T07:00:01.0015Z", {}), morning + 1001500us);
}

TEST(TimeText, IsATimeBeforeNow) {
  EXPECT_EQ(parse_time("90s", morning), morning - 90s);
  EXPECT_EQ(parse_time("15m", morning), morning - 15min);
  EXPECT_EQ(parse_time("5min", morning), morning - 5min);
  EXPECT_EQ(parse_time("7d", morning), morning - 168h);
}

class NoTime : public testing::TestWithParam<const char*> {};

TEST_P(NoTime, IsRefusedWithWhatWasExpected) {
  EXPECT_THAT(parse_time(GetParam(), morning).error(), HasSubstr("expected UTC as in 2026-03-01"));
}

INSTANTIATE_TEST_SUITE_P(Texts, NoTime,
                         testing::Values("", "Z", "d", "-5d", "5w", "30", "1.", "yesterday", "2026",
                                         "2026-13-01", "2026-02-30T07:00:00Z", "2026-3-1T07:00:00Z",
                                         "2026-03-01T", "2026-03-01T07", "2026-03-01T07:00x",
                                         "2026-03-01T24:00:00Z", "2026-03-01T07:00:00Zz",
                                         "2026-03-01T07:00:00.123456789123Z", "07:00"));

}  // namespace
}  // namespace millrace::base::text
