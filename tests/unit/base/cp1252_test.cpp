#include "base/text/cp1252.hpp"

#include <gtest/gtest.h>

namespace millrace::base::text {
namespace {

TEST(Cp1252, BecomesUtf8) {
  EXPECT_EQ(to_utf8("Ma\xDF \x80 \x96"), "Maß € –");
}

TEST(Cp1252, SurvivesTheConversionToUtf8AndBack) {
  std::string all;
  for (int byte = 0; byte < 256; ++byte) {
    all += static_cast<char>(byte);
  }
  EXPECT_EQ(to_cp1252(to_utf8(all)), all);
}

TEST(Cp1252, RefusesACharacterItHasNoByteFor) {
  EXPECT_EQ(to_cp1252("ab中").error(), "U+4E2D at byte 3 is not in CP1252");
  EXPECT_EQ(to_cp1252("\xF0\x9F\x98\x80").error(), "U+1F600 at byte 1 is not in CP1252");
}

/// U+0080 is a control in Unicode; the byte 80 is the euro sign.
TEST(Utf8, IsMoreThanCp1252) {
  EXPECT_TRUE(is_utf8(""));
  EXPECT_TRUE(is_utf8("Maß 中 \xF0\x9F\x98\x80"));
}

TEST(Cp1252, RefusesAControlCharacterWhoseCodeIsTaken) {
  EXPECT_FALSE(to_cp1252("\xC2\x80"));
}

class NotUtf8 : public testing::TestWithParam<std::string_view> {};

TEST_P(NotUtf8, IsRefusedWithItsPlace) {
  EXPECT_EQ(to_cp1252("x" + std::string(GetParam())).error(), "byte 2 is not UTF-8");
  EXPECT_FALSE(is_utf8("x" + std::string(GetParam())));
}

INSTANTIATE_TEST_SUITE_P(Broken, NotUtf8,
                         testing::Values("\xDF",              // CP1252
                                         "\x80",              // a continuation alone
                                         "\xC3",              // truncated
                                         "\xC0\xAF",          // overlong form of '/'
                                         "\xE0\x80\xAF",      // the same in three bytes
                                         "\xF0\x80\x80\xAF",  // the same in four
                                         "\xED\xA0\x80",      // a surrogate
                                         "\xF4\x90\x80\x80",  // beyond Unicode
                                         "\xC3\x28"));        // no continuation

}  // namespace
}  // namespace millrace::base::text
