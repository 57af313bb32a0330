#include "services/mail/template.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::services::mail {
namespace {

using testing::ElementsAre;

TEST(MailTemplate, PutsValuesInTheirPlaces) {
  const auto sut = Template::parse("{parts} of {program}, {{no}} place, again {parts}");
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_THAT(sut->keys(), ElementsAre("parts", "program"));
  EXPECT_EQ(sut->fill({{"parts", "12"}, {"program", "WELLE7"}}),
            "12 of WELLE7, {no} place, again 12");
}

TEST(MailTemplate, NamesTheKeyThatHasNoValue) {
  EXPECT_EQ(Template::parse("{a} {b}")->fill({{"a", "1"}}).error(), "b");
}

TEST(MailTemplate, DoesNotParseValues) {
  EXPECT_EQ(Template::parse("{a}")->fill({{"a", "{b} {{ }"}}), "{b} {{ }");
}

TEST(MailTemplate, HasKeysOfTheCall) {
  EXPECT_THAT(Template::parse("{call.machine}")->keys(), ElementsAre("call.machine"));
}

TEST(MailTemplate, MayBeEmptyOrPlain) {
  EXPECT_EQ(Template::parse("")->fill({}), "");
  EXPECT_EQ(Template::parse("plain")->fill({}), "plain");
}

TEST(MailTemplate, NamesThePlaceOfAWrongBrace) {
  for (const std::string text : {"ab {", "ab {}", "ab }", "ab {a b}", "ab {a.b}", "ab {call.}"}) {
    const auto sut = Template::parse(text);
    ASSERT_FALSE(sut) << text;
    EXPECT_EQ(sut.error(), "expected {key}, {{ or }} at byte 4");
  }
}

}  // namespace
}  // namespace millrace::services::mail
