#include "services/mail/answering.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::services::mail {
namespace {

using namespace std::chrono_literals;
using testing::EndsWith;
using testing::SizeIs;

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
  const Outcome later{.verdict = Verdict::later};
  auto sut = after(entry(), later, policy, false, morning);
  sut = after(*sut, later, policy, false, morning + year);
  EXPECT_EQ(sut->stage, Stage::waiting);
  sut = after(*sut, later, policy, false, sut->next + 1h);
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

}  // namespace
}  // namespace millrace::services::mail
