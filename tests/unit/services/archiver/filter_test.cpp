#include "services/archiver/filter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/services/archiver/rows.hpp"

namespace millrace::services::archiver {
namespace {

using namespace std::chrono_literals;

TEST(FilterTime, IsAPointInUtc) {
  EXPECT_EQ(parse_time("2026-03-01T07:00", {}), morning);
  EXPECT_EQ(parse_time("2026-03-01T07:00:00Z", {}), morning);
  EXPECT_EQ(parse_time("2026-03-01", {}), morning - 7h);
}

TEST(FilterTime, IsATimeBeforeNow) {
  EXPECT_EQ(parse_time("90s", morning), morning - 90s);
  EXPECT_EQ(parse_time("15m", morning), morning - 15min);
  EXPECT_EQ(parse_time("12h", morning), morning - 12h);
  EXPECT_EQ(parse_time("7d", morning), morning - 168h);
}

class NoFilterTime : public testing::TestWithParam<std::string_view> {};

TEST_P(NoFilterTime, IsRefused) {
  EXPECT_THAT(parse_time(GetParam(), morning).error(), testing::HasSubstr("expected a UTC time"));
}

INSTANTIATE_TEST_SUITE_P(Texts, NoFilterTime,
                         testing::Values("", "Z", "d", "-5d", "5w", "yesterday", "2026-13-01",
                                         "2026-03-01T", "2026-03-01T07:00x", "07:00"));

}  // namespace
}  // namespace millrace::services::archiver
