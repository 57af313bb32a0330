#include <cctype>
#include <cstdlib>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/mail/answering.hpp"
#include "services/mail/compose.hpp"
#include "services/mail/config.hpp"
#include "tests/support/data.hpp"
#include "tests/support/expected_mistakes.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::services::mail {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;

TEST(MailRequest, HasATemplateAndValues) {
  const auto sut = parse("done program=WELLE7 parts=12");
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->template_name, "done");
  EXPECT_THAT(sut->values, ElementsAre(Pair("parts", "12"), Pair("program", "WELLE7")));
  EXPECT_THAT(sut->to, IsEmpty());
}

TEST(MailRequest, ConvertsItsValuesToUtf8) {
  EXPECT_THAT(parse("a text=\"Ma\xDF 1\"")->values, ElementsAre(Pair("text", "Maß 1")));
}

TEST(MailRequest, MayNameRecipients) {
  const auto sut = parse("\talarm to=shift2,boss  why=oil");
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_THAT(sut->to, ElementsAre("shift2", "boss"));
  EXPECT_THAT(sut->values, ElementsAre(Pair("why", "oil")));
}

struct Mistake {
  std::string request;
  std::string error;
};

class WrongMailRequest : public testing::TestWithParam<Mistake> {};

TEST_P(WrongMailRequest, ReportsWhatIsWrong) {
  const auto sut = parse(GetParam().request);
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error(), HasSubstr(GetParam().error));
}

INSTANTIATE_TEST_SUITE_P(
    Requests, WrongMailRequest,
    testing::Values(Mistake{"", "the request is empty"}, Mistake{" \t", "the request is empty"},
                    Mistake{"/etc/passwd", "no template can be called '/etc/passwd'"},
                    Mistake{"$(reboot)", "no template can be called '$(reboot)'"},
                    Mistake{"done program", "expected key=value at 'program'"},
                    Mistake{"done a=1 a=2", "key 'a' occurs twice"},
                    Mistake{"done a=\"1", "no closing quote"},
                    Mistake{"done a=\"1\nBcc: x\"", "byte 10 of the request (0x0A) is not text"},
                    Mistake{"done a=1\rb", "byte 9 of the request (0x0D) is not text"},
                    Mistake{std::string("done a=\0", 8), "byte 8 of the request (0x00)"},
                    Mistake{"done a=\x81", "byte 8 of the request (0x81)"},
                    Mistake{"done to=", "no recipient can be called ''"},
                    Mistake{"done to=a,,b", "no recipient can be called ''"},
                    Mistake{"done to=x@evil.example", "no recipient can be called 'x@evil"},
                    Mistake{std::string(127, '\xFF'), "no template can be called"},
                    Mistake{std::string(127, 'a'), "no template can be called"}));

const fabric::Time morning(1772352000s);
const RetryPolicy policy{.first = 10s, .longest = 60s, .give_up = std::chrono::hours(1)};

Entry entry() {
  return {.call = {.epoch = 1, .number = 2},
          .mail = {.from = "a@b", .to = {"c@d"}, .message = "m"},
          .made = morning};
}

TEST(MailAnswering, WaitsTwiceAsLongEachTime) {
  EXPECT_EQ(pause_after(1, policy), 10s);
  EXPECT_EQ(pause_after(2, policy), 20s);
  EXPECT_EQ(pause_after(3, policy), 40s);
  EXPECT_EQ(pause_after(4, policy), 60s);
  EXPECT_EQ(pause_after(4'000'000'000, policy), 60s);
}

TEST(MailAnswering, KeepsNoMessageOnceItIsAccepted) {
  const auto sut = after(entry(), {.verdict = Verdict::accepted}, policy, true, morning);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->stage, Stage::accepted);
  EXPECT_EQ(sut->mail, Mail());
  EXPECT_EQ(answer_from(*sut), (sdk::Response{.text = "OK", .state = 1}));
}

TEST(MailAnswering, RetriesWhatIsRefusedForNow) {
  const auto sut =
      after(entry(), {.verdict = Verdict::later, .reply = "451 busy"}, policy, true, morning);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->stage, Stage::waiting);
  EXPECT_EQ(sut->next, morning + 10s);
  EXPECT_EQ(sut->mail.message, "m");
  EXPECT_EQ(answer_from(*sut), (sdk::Response{.text = "sent later: 451 busy", .state = 2}));
}

TEST(MailAnswering, GivesUpInTheEndAndKeepsTheMessage) {
  const auto sut = after(entry(), {.verdict = Verdict::later}, policy, false, morning + 1h);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->stage, Stage::given_up);
  EXPECT_EQ(sut->mail.message, "m");
  EXPECT_EQ(answer_from(*sut).state, 14U);
}

TEST(MailAnswering, DoesNotCountTimeInWhichNothingWasTried) {
  constexpr auto year = std::chrono::hours(8760);
  const Outcome no_success{.verdict = Verdict::later};
  auto sut = after(entry(), no_success, policy, false, morning);
  sut = after(*sut, no_success, policy, false, morning + year);
  EXPECT_EQ(sut->stage, Stage::waiting);
  sut = after(*sut, no_success, policy, false, sut->next + 1h);
  EXPECT_EQ(sut->stage, Stage::given_up);
}

TEST(MailAnswering, KeepsTheMessageOfARefusalWithoutAWaitingProgram) {
  const Outcome refused{.verdict = Verdict::refused, .reply = "550 no"};
  EXPECT_EQ(after(entry(), refused, policy, true, morning)->mail.message, "");
  EXPECT_EQ(after(entry(), refused, policy, false, morning)->mail.message, "m");
}

TEST(MailAnswering, KeepsNothingOfAMailThatCouldNotEvenBeTried) {
  for (const Verdict verdict : {Verdict::insecure, Verdict::login}) {
    EXPECT_FALSE(after(entry(), {.verdict = verdict}, policy, true, morning));
    EXPECT_EQ(after(entry(), {.verdict = verdict}, policy, false, morning)->stage, Stage::waiting);
  }
}

TEST(MailAnswering, NeverRetriesWhatIsInDoubt) {
  const auto sut = after(entry(), {.verdict = Verdict::doubt}, policy, true, morning);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->stage, Stage::handed_over);
  EXPECT_EQ(answer_from(*sut).state, 17U);
}

TEST(MailAnswering, HasAStateForEachOutcome) {
  EXPECT_EQ(answer_to({.verdict = Verdict::refused}).state, 14U);
  EXPECT_EQ(answer_to({.verdict = Verdict::insecure}).state, 15U);
  EXPECT_EQ(answer_to({.verdict = Verdict::login}).state, 16U);
}

TEST(MailAnswering, ShowsAnyTextOfAServer) {
  const auto answer =
      answer_to({.verdict = Verdict::refused, .reply = "550 \xFF\x01 " + std::string(500, 'x')});
  EXPECT_THAT(answer.text, SizeIs(127));
  EXPECT_THAT(answer.text, EndsWith("..."));
  EXPECT_EQ(answer.text.find('\x01'), std::string::npos);
  EXPECT_EQ(answer_to({.verdict = Verdict::refused, .reply = "550 für"}).text,
            "ERROR: the mail server refuses: 550 f\xFCr");
}

std::filesystem::path data(const std::string& name) {
  return tests::test_data("config") / name;
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
  EXPECT_EQ(sut->rules[1].kind, Rule::Kind::concern);
  EXPECT_EQ(sut->rules[1].least, fabric::plant::Level::act);
  EXPECT_TRUE(sut->rules[1].kinds.empty());
  EXPECT_EQ(sut->rules[1].after.count(), 0);
  EXPECT_EQ(sut->rules[1].quiet, std::chrono::minutes(15));
  EXPECT_EQ(sut->rules[2].least, fabric::plant::Level::look);
  EXPECT_THAT(sut->rules[2].kinds,
              ElementsAre(fabric::plant::Kind::gateway_gone, fabric::plant::Kind::link_down));
  EXPECT_EQ(sut->rules[2].after, std::chrono::seconds(30));
  EXPECT_EQ(sut->rules[3].uuid, "560aacbf-6335-44a9-895a-8b27f3ed5e47");
  EXPECT_EQ(sut->rules[3].after, std::chrono::seconds(60));
}

/// A configuration with one rule, for this kind.
std::string with_kind(const std::string& kind) {
  return "server { host: 'h' } from: 'a@b.example' recipient { name: 'r' address: 'a@b.example' }\n"
         "rule { name: 'n' concern: LOOK kind: " +
         kind + " to: 'r' }\n";
}

TEST(MailConfig, HasEachKindOfConcernOfAPlant) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "mail.textproto";
  for (auto kind = fabric::plant::Kind::held; kind <= fabric::plant::Kind::unknown;
       kind = static_cast<fabric::plant::Kind>(static_cast<int>(kind) + 1)) {
    std::string name(name_of(kind));
    for (char& c : name) {
      c = c == ' ' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
    std::ofstream(file) << with_kind(name);
    const auto sut = load(file);
    ASSERT_TRUE(sut) << sut.error();
    EXPECT_THAT(sut->rules[0].kinds, ElementsAre(kind));
  }
}

}  // namespace
}  // namespace millrace::services::mail
