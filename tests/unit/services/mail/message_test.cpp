#include "services/mail/message.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/mail/compose.hpp"
#include "services/mail/template.hpp"
#include "services/text/answer.hpp"
#include "tests/unit/services/mail/sample.hpp"

namespace millrace::services::mail {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::SizeIs;

Content content() {
  return {.from = {"Press 1", "press1@example.com"},
          .to = {{"Eva Müller", "eva@example.com"}, {"", "bob@example.com"}},
          .date = fabric::Time(std::chrono::seconds(1772352000)),
          .message_id = "5f-3.millrace@example.com",
          .subject = "WELLE7: 12 parts",
          .text = "Maß = 1\nBye\n"};
}

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find("\r\n", at);
    lines.push_back(text.substr(at, end - at));
    at = end == std::string::npos ? text.size() : end + 2;
  }
  return lines;
}

TEST(MailMessage, FollowsRfc5322) {
  EXPECT_EQ(to_message(content()),
            "Date: Sun, 01 Mar 2026 08:00:00 +0000\r\n"
            "From: Press 1 <press1@example.com>\r\n"
            "To: =?utf-8?Q?Eva_M=C3=BCller?= <eva@example.com>,\r\n"
            " bob@example.com\r\n"
            "Message-ID: <5f-3.millrace@example.com>\r\n"
            "Subject: WELLE7: 12 parts\r\n"
            "Auto-Submitted: auto-generated\r\n"
            "MIME-Version: 1.0\r\n"
            "Content-Type: text/plain; charset=utf-8\r\n"
            "Content-Transfer-Encoding: quoted-printable\r\n"
            "\r\n"
            "Ma=C3=9F =3D 1\r\n"
            "Bye\r\n");
}

TEST(MailMessage, AllowsNoSubjectOrNameToBeginAHeader) {
  Content evil = content();
  evil.subject = "A\r\nBcc: x@evil.example\r\n\r\nbody";
  evil.from.name = "B\nCc: y@evil.example";
  const std::string sut = to_message(evil);
  EXPECT_THAT(sut, AllOf(HasSubstr("\r\nSubject: A  Bcc: x@evil.example    body\r\n"),
                         Not(HasSubstr("\nBcc")), Not(HasSubstr("\nCc"))));
}

TEST(MailMessage, AllowsNoSubjectToChangeTheOrderOfText) {
  Content evil = content();
  evil.subject = "A\u202etxt\u0085.exe";
  EXPECT_THAT(to_message(evil), HasSubstr("\r\nSubject: A txt .exe\r\n"));
}

TEST(MailMessage, EncodesOtherThanPlainTextInSevenBits) {
  EXPECT_EQ(header_text("Maß"), "=?utf-8?Q?Ma=C3=9F?=");
  EXPECT_EQ(header_text("=?utf-8?Q?fake?="), "=?utf-8?Q?=3D=3Futf=2D8=3FQ=3Ffake=3F=3D?=");
  EXPECT_EQ(header_text("plain, with: marks"), "plain, with: marks");
  EXPECT_EQ(header_text(""), "");
}

TEST(MailMessage, FoldsLongHeadersBetweenCharacters) {
  std::string subject;
  for (int i = 0; i < 60; ++i) {
    subject += "€";
  }
  const auto words = lines(header_text(subject));
  EXPECT_THAT(words, SizeIs(testing::Gt(3U)));
  std::size_t characters = 0;
  for (const std::string& word : words) {
    EXPECT_LE(word.size(), 76U);
    const std::size_t start = word.find("=?utf-8?Q?");
    ASSERT_NE(start, std::string::npos);
    const std::string inside = word.substr(start + 10, word.size() - start - 12);
    EXPECT_EQ(inside.size() % 9, 0U) << "a character is split: " << inside;
    characters += inside.size() / 9;
  }
  EXPECT_EQ(characters, 60U);
}

// "°°°…" in Latin-1: bytes that never begin a UTF-8 character.
TEST(MailMessage, FoldsHeadersOfBytesThatAreNoUtf8) {
  for (const std::string& line : lines("Subject: " + header_text(std::string(400, '\xB0')))) {
    EXPECT_LE(line.size(), 76U) << line;
  }
}

TEST(MailMessage, BreaksLongLinesOfTheBody) {
  const std::string sut = quoted_printable(std::string(300, 'x') + "\n" + std::string(100, '='));
  for (const std::string& line : lines(sut)) {
    EXPECT_LE(line.size(), 76U);
  }
}

TEST(MailMessage, KeepsBlanksAtLineEndsAndAcceptsAnyLineEnd) {
  EXPECT_EQ(quoted_printable("a \nb\t\r\nc\rd"), "a=20\r\nb=09\r\nc\r\nd\r\n");
  EXPECT_EQ(quoted_printable(""), "");
  EXPECT_EQ(quoted_printable("\n\n"), "\r\n\r\n");
}

TEST(MailAddress, HasANameOrNone) {
  EXPECT_EQ(parse_address("eva@example.com"), (Address{.mailbox = "eva@example.com"}));
  EXPECT_EQ(parse_address(" Eva Müller  <eva.m+press@mail.example.com> "),
            (Address{"Eva Müller", "eva.m+press@mail.example.com"}));
  EXPECT_EQ(parse_address("\"Müller, Eva\" <eva@example.com>"),
            (Address{"Müller, Eva", "eva@example.com"}));
  EXPECT_EQ(parse_address("<eva@localhost>"), (Address{.mailbox = "eva@localhost"}));
  EXPECT_EQ(domain_of({.mailbox = "eva@example.com"}), "example.com");
}

class WrongMailAddress : public testing::TestWithParam<std::string> {};

TEST_P(WrongMailAddress, IsRefused) {
  EXPECT_FALSE(parse_address(GetParam()));
}

INSTANTIATE_TEST_SUITE_P(Addresses, WrongMailAddress,
                         testing::Values("", "eva", "@example.com", "eva@", "a b@example.com",
                                         "eva@exam ple.com", "eva..m@example.com",
                                         ".eva@example.com", "eva@example.com.", "eva@b>",
                                         "eva@example.com, bob@example.com", "E <eva@a> <b@c>",
                                         "eva@example.com\r\nRCPT TO:<x@y>", "eva@m\xC3\xBC.de",
                                         "Eva\n <eva@example.com>", "E\xFF <eva@example.com>",
                                         std::string(65, 'a') + "@example.com",
                                         "eva@" + std::string(251, 'a')));

TEST(MailAddress, ReportsWhatIsWrong) {
  EXPECT_THAT(parse_address("eva").error(), HasSubstr("'eva' is not an address; expected user@"));
}

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

const fabric::Time that_morning(std::chrono::seconds(1772352000));

TEST(MailCompose, MakesTheMailOfATemplate) {
  const auto sut =
      compose(sample_config(), sample_call("done program=WELLE7 parts=12"), that_morning);
  ASSERT_TRUE(sut) << sut.error().text;
  EXPECT_EQ(sut->from, "press1@example.com");
  EXPECT_THAT(sut->to, ElementsAre("eva@example.com", "bob@example.com"));
  EXPECT_THAT(sut->message,
              AllOf(HasSubstr("\r\nSubject: WELLE7: 12 parts\r\n"),
                    HasSubstr("\r\nMessage-ID: <5f-3.millrace@example.com>\r\n"),
                    HasSubstr("\r\n\r\ncnc/2 9 5f-3 2026-03-01 08:00:00 UTC: done program=3D")));
}

TEST(MailCompose, IsTheSameForTheSameCall) {
  const fabric::Request call = sample_call("done program=A parts=1");
  EXPECT_EQ(compose(sample_config(), call, that_morning),
            compose(sample_config(), call, that_morning));
}

TEST(MailCompose, WritesToTheRecipientsOfTheRequest) {
  EXPECT_THAT(compose(sample_config(), sample_call("alarm to=boss"), that_morning)->to,
              ElementsAre("boss@example.com"));
  EXPECT_THAT(
      compose(sample_config(), sample_call("done to=boss program=A parts=1"), that_morning)->to,
      ElementsAre("boss@example.com"));
}

TEST(MailCompose, WritesToEachMailboxOnceHoweverOftenItIsNamed) {
  Config config = sample_config();
  config.recipients["all"] = {{"The boss", "boss@example.com"}, {"", "bob@example.com"}};
  const auto sut = compose(config, sample_call("alarm to=boss,boss,all,boss"), that_morning);
  ASSERT_TRUE(sut) << sut.error().text;
  EXPECT_THAT(sut->to, ElementsAre("boss@example.com", "bob@example.com"));
  EXPECT_THAT(sut->message, HasSubstr("\r\nTo: boss@example.com,"));
}

struct Case {
  std::string request;
  std::uint32_t state;
  std::string text;
};

class WrongMailCall : public testing::TestWithParam<Case> {};

TEST_P(WrongMailCall, IsAnsweredWithAStateAndTheReason) {
  const auto sut = compose(sample_config(), sample_call(GetParam().request), that_morning);
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error(), (text::error(GetParam().state, GetParam().text)));
}

INSTANTIATE_TEST_SUITE_P(
    Calls, WrongMailCall,
    testing::Values(
        Case{"", 10, "the request is empty; expected TEMPLATE key=value ..."},
        Case{"finished a=1", 11, "unknown template 'finished'; known are alarm done"},
        Case{"done program=A", 12, "template 'done' needs parts=..."},
        Case{"done program=A parts=1 x=2", 12,
             "template 'done' has no placeholder for 'x'; it has parts program"},
        Case{"alarm x=2", 12, "template 'alarm' has no placeholder for 'x'; it has none"},
        Case{"alarm", 13, "template 'alarm' needs to=RECIPIENT"},
        Case{"alarm to=boss,eve", 13, "unknown recipient 'eve'; known are boss shift"}));

}  // namespace
}  // namespace millrace::services::mail
