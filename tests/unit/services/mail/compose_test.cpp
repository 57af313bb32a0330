#include "services/mail/compose.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/text/answer.hpp"
#include "tests/unit/services/mail/sample.hpp"

namespace millrace::services::mail {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

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
  const CallInfo call = sample_call("done program=A parts=1");
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
