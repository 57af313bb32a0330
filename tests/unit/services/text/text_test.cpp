#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/messages.hpp"
#include "services/text/answer.hpp"
#include "services/text/fields.hpp"

namespace millrace::services::text {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::IsEmpty;

TEST(Answer, OfAnErrorBeginsWithTheWord) {
  EXPECT_EQ(error(11, "no gauge 'x'"), (sdk::Response{.text = "ERROR: no gauge 'x'", .state = 11}));
}

TEST(Answer, OfALongErrorFitsAndShowsItsCut) {
  const sdk::Response sut = error(11, std::string(200, 'x'));
  EXPECT_EQ(sut.text.size(), fabric::max_text);
  EXPECT_THAT(sut.text, EndsWith("x..."));
}

TEST(Answer, OfAnErrorThatJustFitsIsNotCut) {
  const std::string message(fabric::max_text - 7, 'x');
  EXPECT_EQ(error(11, message).text, "ERROR: " + message);
}

TEST(InQuotes, ReplacesWhatDoesNotPrint) {
  EXPECT_EQ(in_quotes("a\r\nb\x81\x7F\xDF"), "'a??b??\xDF'");
}

TEST(InQuotes, ShortensLongText) {
  EXPECT_EQ(in_quotes(std::string(33, 'x')).size(), 34U);
}

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

TEST(Words, AreWhatIsBetweenBlanks) {
  EXPECT_THAT(words("  READ \t depth "), ElementsAre("READ", "depth"));
  EXPECT_THAT(words("one"), ElementsAre("one"));
}

TEST(Words, AreNoneInNothingAndBlanks) {
  EXPECT_THAT(words(""), IsEmpty());
  EXPECT_THAT(words(" \t "), IsEmpty());
}

TEST(UpperCase, LeavesAllButAsciiLettersAlone) {
  EXPECT_EQ(upper_case("aZ9_\xE4"), "AZ9_\xE4");
}

TEST(NameCharacter, IsAnAsciiLetterDigitUnderscoreOrHyphen) {
  for (const char c : std::string_view("azAZ09_-")) {
    EXPECT_TRUE(is_name_character(c)) << c;
  }
  for (const char c : std::string_view(" ./;$\xE4\x00", 7)) {
    EXPECT_FALSE(is_name_character(c)) << c;
  }
}

}  // namespace
}  // namespace millrace::services::text
