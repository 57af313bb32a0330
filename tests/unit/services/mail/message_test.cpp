#include "services/mail/message.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::services::mail {
namespace {

using testing::AllOf;
using testing::Each;
using testing::HasSubstr;
using testing::Not;
using testing::SizeIs;
using testing::StartsWith;

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

}  // namespace
}  // namespace millrace::services::mail
