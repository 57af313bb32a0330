#include "services/text/fields.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::services::text {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(Fields, ArePairsWithBlanksBetween) {
  EXPECT_THAT(*fields(" a=1\tb=x=y  c= "),
              ElementsAre(Field{"a", "1"}, Field{"b", "x=y"}, Field{"c", ""}));
  EXPECT_THAT(*fields(" \t"), IsEmpty());
}

TEST(Fields, MayHaveQuotedValues) {
  EXPECT_THAT(*fields(R"(say="we said ""no""" none="")"),
              ElementsAre(Field{"say", "we said \"no\""}, Field{"none", ""}));
}

TEST(Fields, ReportWhatIsWrong) {
  EXPECT_EQ(fields("a=1 b").error(), "expected key=value at 'b'");
  EXPECT_EQ(fields("a=1 a=2").error(), "key 'a' occurs twice");
  EXPECT_EQ(fields("a=\"1").error(), "no closing quote for '\"1'");
}

TEST(Fields, HaveNamesOfLettersDigitsUnderscoreAndMinus) {
  EXPECT_TRUE(is_name("part_7-b"));
  EXPECT_TRUE(is_name(std::string(32, 'a')));
  EXPECT_FALSE(is_name(std::string(33, 'a')));
  EXPECT_FALSE(is_name(""));
  EXPECT_FALSE(is_name("a.b"));
  EXPECT_FALSE(is_name("\xFC"));
}

}  // namespace
}  // namespace millrace::services::text
