#include <gtest/gtest.h>

#include "services/mail/mail.hpp"

namespace millrace::services::mail {
namespace {

struct OutcomeCase {
  const char* what;
  Exchange exchange;
  Verdict verdict;
};

class MailOutcome : public testing::TestWithParam<OutcomeCase> {};

TEST_P(MailOutcome, FollowsFromTheResponsesOfTheServer) {
  EXPECT_EQ(outcome_of(GetParam().exchange).verdict, GetParam().verdict) << GetParam().what;
}

INSTANTIATE_TEST_SUITE_P(
    Exchanges, MailOutcome,
    testing::Values(
        OutcomeCase{
            "taken", {.handed_over = true, .code = 250, .replied_after = true}, Verdict::accepted},
        OutcomeCase{"no contact", {.trouble = ConnectionError::no_contact}, Verdict::later},
        OutcomeCase{
            "broken before", {.trouble = ConnectionError::broken, .code = 354}, Verdict::later},
        OutcomeCase{
            "greeting 421", {.trouble = ConnectionError::broken, .code = 421}, Verdict::later},
        OutcomeCase{
            "greeting 554", {.trouble = ConnectionError::broken, .code = 554}, Verdict::refused},
        OutcomeCase{
            "recipient 550", {.trouble = ConnectionError::broken, .code = 550}, Verdict::refused},
        OutcomeCase{"message 451",
                    {.trouble = ConnectionError::broken,
                     .handed_over = true,
                     .code = 451,
                     .replied_after = true},
                    Verdict::later},
        OutcomeCase{"message 554",
                    {.trouble = ConnectionError::broken,
                     .handed_over = true,
                     .code = 554,
                     .replied_after = true},
                    Verdict::refused},
        OutcomeCase{"broken behind the message",
                    {.trouble = ConnectionError::broken, .handed_over = true, .code = 354},
                    Verdict::doubt},
        OutcomeCase{"an earlier refusal says nothing about the message",
                    {.trouble = ConnectionError::broken, .handed_over = true, .code = 502},
                    Verdict::doubt},
        OutcomeCase{
            "certificate", {.trouble = ConnectionError::tls, .code = 220}, Verdict::insecure},
        OutcomeCase{"password", {.trouble = ConnectionError::login, .code = 535}, Verdict::login},
        OutcomeCase{
            "login for now", {.trouble = ConnectionError::login, .code = 454}, Verdict::later},
        OutcomeCase{"no supported login method",
                    {.trouble = ConnectionError::login, .code = 354},
                    Verdict::login}));

TEST(MailOutcome, HasTheServersTextOrTheConnectionError) {
  EXPECT_EQ(outcome_of({.trouble = ConnectionError::broken,
                        .trouble_text = "RCPT failed",
                        .code = 550,
                        .reply = "550 unknown"})
                .reply,
            "550 unknown");
  const Outcome gone =
      outcome_of({.trouble = ConnectionError::no_contact, .trouble_text = "refused"});
  EXPECT_EQ(gone.reply, "refused");
  EXPECT_FALSE(gone.contact);
}

TEST(MailOutcome, DistinguishesAStalledServerFromAnUnreachableOne) {
  const Outcome stalled = outcome_of({.trouble = ConnectionError::timeout, .code = 250});
  EXPECT_EQ(stalled.verdict, Verdict::later);
  EXPECT_TRUE(stalled.contact);
  EXPECT_TRUE(stalled.stalled);
  const Outcome silent = outcome_of({.trouble = ConnectionError::timeout});
  EXPECT_EQ(silent.verdict, Verdict::later);
  EXPECT_FALSE(silent.contact);
  EXPECT_FALSE(silent.stalled);
}

}  // namespace
}  // namespace millrace::services::mail
