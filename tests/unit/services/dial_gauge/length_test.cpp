#include "services/dial_gauge/length.hpp"

#include <gtest/gtest.h>

namespace millrace::services::dial_gauge {
namespace {

TEST(Length, IsExactInMillimetresAndInches) {
  EXPECT_EQ(parse_length("+00000011.88", Unit::mm), 11'880'000);
  EXPECT_EQ(parse_length("-0000000.001", Unit::mm), -1'000);
  EXPECT_EQ(parse_length("+00.12345", Unit::inch), 3'135'630);
  EXPECT_EQ(parse_length("+1", Unit::mm), 1'000'000);
}

class NoLength : public testing::TestWithParam<std::string_view> {};

TEST_P(NoLength, IsRefused) {
  EXPECT_FALSE(parse_length(GetParam(), Unit::mm));
}

INSTANTIATE_TEST_SUITE_P(Texts, NoLength,
                         testing::Values("", "+", "-.", "1.5", "+1.5 ", " +1.5", "+1,5", "+1.2.3",
                                         "+0x10", "+1e3", "++1", "+nan", "+0.1234567",
                                         "+1234567890123"));

TEST(Length, ThatDoesNotFitIsRefused) {
  EXPECT_FALSE(parse_length("+999999999999", Unit::inch));
}

TEST(Length, IsShownInMillimetresWithItsUnit) {
  EXPECT_EQ(to_text(12'345'000, 3), "12.345 mm");
  EXPECT_EQ(to_text(-1'000, 3), "-0.001 mm");
  EXPECT_EQ(to_text(5'000'000, 0), "5 mm");
  EXPECT_EQ(to_text(1, 6), "0.000001 mm");
}

TEST(Length, IsRoundedHalfAwayFromZero) {
  EXPECT_EQ(to_text(1'500, 3), "0.002 mm");
  EXPECT_EQ(to_text(-1'500, 3), "-0.002 mm");
  EXPECT_EQ(to_text(1'499, 3), "0.001 mm");
}

TEST(Length, HasNoSignIfItRoundsToZero) {
  EXPECT_EQ(to_text(-499, 3), "0.000 mm");
}

TEST(Length, IsQuantisedToTheNearestStep) {
  EXPECT_EQ(quantised(12'345'678.0, 10'000), 12'350'000);
  EXPECT_EQ(quantised(-4'999.0, 10'000), 0);
}

}  // namespace
}  // namespace millrace::services::dial_gauge
