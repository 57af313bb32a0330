#include "services/mail/config.hpp"

#include <cstdlib>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/expected_mistakes.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::services::mail {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

std::filesystem::path data(const std::string& name) {
  return std::filesystem::path(MILLRACE_TEST_DATA) / "config" / name;
}

TEST(MailConfig, FillsDefaults) {
  const auto sut = load(data("good/minimal.mail.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->server.port, 587);
  EXPECT_EQ(sut->server.security, Security::starttls);
  EXPECT_EQ(sut->server.timeout, 60s);
  EXPECT_EQ(sut->spool, data("good/mail.spool"));
  EXPECT_EQ(sut->retry.first, 10s);
  EXPECT_EQ(sut->retry.longest, 15min);
  EXPECT_EQ(sut->remember, std::chrono::hours(30 * 24));
}

TEST(MailConfig, ReadsEveryField) {
  const auto sut = load(data("good/full.mail.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->server.host, "mail.example.com");
  EXPECT_EQ(sut->server.port, 2525);
  EXPECT_EQ(sut->server.ca_file, data("good/ca.pem"));
  EXPECT_EQ(sut->server.user, "press");
  EXPECT_EQ(sut->server.password_file, "/run/password");
  EXPECT_EQ(sut->server.connect_timeout, 1s);
  EXPECT_EQ(sut->server.timeout, 2s);
  EXPECT_EQ(sut->from, (Address{"Prässe 1", "press1@example.com"}));
  EXPECT_THAT(sut->recipients.at("shift"),
              ElementsAre(Address{"Eva", "eva@example.com"}, Address{"", "bob@example.com"}));
  EXPECT_THAT(sut->templates.at("done").to, ElementsAre("shift"));
  EXPECT_THAT(sut->templates.at("done").subject.keys(), ElementsAre("program"));
  EXPECT_EQ(sut->spool, "/var/lib/millrace/mail");
  EXPECT_EQ(sut->retry.first, 5ms);
  EXPECT_EQ(sut->retry.longest, 6ms);
  EXPECT_EQ(sut->retry.give_up, std::chrono::hours(7));
}

TEST(MailConfig, NamesEveryMistakeWithItsPlace) {
  tests::expect_mistakes("mail", [](const auto& file) {
    const auto sut = load(file);
    return sut ? "no error" : sut.error();
  });
}

TEST(MailPassword, IsTheFirstLineOfItsFile) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "password";
  EXPECT_THAT(password({.user = "u", .password_file = file}).error(),
              HasSubstr("cannot read the password in " + file.string()));
  std::ofstream(file) << "correct horse\r\nbattery\n";
  EXPECT_EQ(password({.user = "u", .password_file = file}), "correct horse");
}

TEST(MailPassword, MayComeFromTheEnvironment) {
  ASSERT_EQ(::setenv("MILLRACE_TEST_PASSWORD", "staple", 1), 0);
  EXPECT_EQ(password({.user = "u", .password_env = "MILLRACE_TEST_PASSWORD"}), "staple");
  EXPECT_THAT(password({.user = "u", .password_env = "MILLRACE_NO_PASSWORD"}).error(),
              HasSubstr("the environment has no MILLRACE_NO_PASSWORD"));
  EXPECT_EQ(password({}), "");
}

TEST(MailConfig, HasRules) {
  const auto sut = load(data("good/rules.mail.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  ASSERT_EQ(sut->rules.size(), 4U);
  EXPECT_EQ(sut->rules[0].kind, Rule::Kind::program);
  EXPECT_TRUE(sut->rules[0].events.contains(fabric::ProgramEventKind::aborted));
  EXPECT_TRUE(sut->rules[0].machines.contains("press"));
  EXPECT_EQ(sut->rules[0].quiet.count(), 0);
  EXPECT_EQ(sut->rules[1].after, std::chrono::seconds(60));
  EXPECT_EQ(sut->rules[1].quiet, std::chrono::minutes(15));
  EXPECT_EQ(sut->rules[2].kind, Rule::Kind::link_down);
  EXPECT_EQ(sut->rules[3].uuid, "560aacbf-6335-44a9-895a-8b27f3ed5e47");
  EXPECT_EQ(sut->rules[3].after, std::chrono::seconds(60));
}

}  // namespace
}  // namespace millrace::services::mail
