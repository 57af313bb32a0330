#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/text/fields.hpp"

namespace millrace::services::text {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

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
