#include "cnc/variables/probe.hpp"

#include <gmock/gmock.h>

#include "cnc/variables/service_variable.hpp"
#include "tests/unit/cnc/variables/controller_fixture.hpp"

namespace millrace::cnc::variables {
namespace {

using ads::ErrorCode;
using testing::AllOf;
using testing::HasSubstr;

class ProbeTest : public ControllerFixture {
 protected:
  ProbeTest() {
    for (const ServiceVariable variable : all_service_variables) {
      cnc.values[std::string(name_of(variable))] = Bytes(is_state(variable) ? 4 : 128);
    }
  }
  Answer answer_about(const std::string& what) {
    const auto found = wait_for(probe(*client, "CH[{channel}].{variable}"));
    channels = found.channels;
    for (const Answer& answer : found.answers) {
      if (answer.what == what) {
        return answer;
      }
    }
    return {"", "nothing was said of it"};
  }

  std::uint32_t channels = 0;
};

TEST_F(ProbeTest, FindsTheServiceInterfaceOfEachChannel) {
  cnc.channels = 2;
  cnc.values["V.G.SERVICE.REQUEST"] = {'2', '7', 0};
  cnc.values["V.G.SERVICE.REQUEST_STATE"] = {7, 0, 0, 0};
  start();
  const Answer sut = answer_about("channel 2");
  EXPECT_EQ(sut.answer,
            "UUID \"\", REQUEST \"27\", REQUEST_STATE 7, RESPONSE_STATE 0, RESPONSE \"\"");
  EXPECT_EQ(sut.verdict, Verdict::there);
  EXPECT_EQ(channels, 2U);
}

TEST_F(ProbeTest, NamesTheVariableThatIsMissing) {
  cnc.values.erase("V.G.SERVICE.RESPONSE");
  start();
  const Answer sut = answer_about("channel 1");
  EXPECT_THAT(sut.answer, HasSubstr("RESPONSE_STATE 0, RESPONSE 0x710 symbol not found"));
  EXPECT_EQ(sut.verdict, Verdict::missing);
}

TEST_F(ProbeTest, ReportsThatThereIsNoServiceInterface) {
  cnc.values.clear();
  start();
  const Answer sut = answer_about("Service Interface");
  EXPECT_THAT(sut.answer, HasSubstr("the controller has no Service Interface"));
  EXPECT_EQ(sut.verdict, Verdict::missing);
  EXPECT_EQ(channels, 0U);
}

TEST_F(ProbeTest, FindsTheVariablesOfAnOlderController) {
  cnc.group = decoder_group - new_group_bit;
  start();
  EXPECT_EQ(answer_about("channel 1").verdict, Verdict::there);
}

TEST_F(ProbeTest, NamesTheTasksAndTheRequiredOne) {
  start();
  EXPECT_THAT(answer_about("AMS port 552 (SDA)").answer, HasSubstr("run"));
  EXPECT_EQ(answer_about("AMS port 552 (SDA)").verdict, Verdict::there);
  EXPECT_THAT(answer_about("AMS port 551 (GEO)").answer,
              AllOf(HasSubstr("0x6 "), HasSubstr("no machine data")));
  EXPECT_EQ(answer_about("AMS port 553 (COM)").verdict, Verdict::optional);
}

TEST_F(ProbeTest, ReportsWhetherSumCommandsAreAnswered) {
  start();
  EXPECT_EQ(answer_about("sum commands").verdict, Verdict::there);
  start(false);
  EXPECT_THAT(answer_about("sum commands").answer,
              HasSubstr("each variable needs its own request"));
  EXPECT_EQ(answer_about("sum commands").verdict, Verdict::optional);
}

TEST_F(ProbeTest, ReportsWhyNotificationsAreRefused) {
  start();
  const Answer sut = answer_about("notifications");
  EXPECT_THAT(sut.answer,
              AllOf(HasSubstr("CH[1].V.G.SERVICE.REQUEST_STATE"), HasSubstr("the gateway polls")));
  EXPECT_EQ(sut.verdict, Verdict::optional);
}

TEST_F(ProbeTest, ReportsThatTheControllerIsNotReady) {
  cnc.failure = ErrorCode::not_ready;
  start();
  EXPECT_THAT(answer_about("Service Interface").answer, HasSubstr("0x707"));
}

class SurveyTest : public ControllerFixture {
 protected:
  SurveyTest() { cnc.values["V.G.SERVICE.REQUEST_STATE"] = {0, 0, 0, 0}; }
  void SetUp() override { start(); }
};

TEST_F(SurveyTest, CountsTheChannels) {
  cnc.channels = 3;
  const auto sut = wait_for(survey(*client));
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->channels, 3U);
  EXPECT_EQ(sut->finding, "channels 1 to 3 have a Service Interface");
}

TEST_F(SurveyTest, EndsAtItsLimit) {
  cnc.channels = 100;
  EXPECT_EQ(wait_for(survey(*client, {}, 5))->channels, 5U);
}

TEST_F(SurveyTest, ReportsThatAControllerHasNoServiceInterfaceWhateverItsCode) {
  cnc.values.clear();
  for (const auto code :
       {ErrorCode::symbol_not_found, ErrorCode::invalid_data, ErrorCode::not_found,
        ErrorCode::invalid_offset, ErrorCode::service_not_supported}) {
    cnc.unknown_name = code;
    const auto sut = wait_for(survey(*client));
    ASSERT_TRUE(sut);
    EXPECT_EQ(sut->channels, 0U);
    EXPECT_THAT(sut->finding, AllOf(HasSubstr("the controller has no Service Interface"),
                                    HasSubstr("V.G.SERVICE.REQUEST_STATE of channel 1"),
                                    HasSubstr(ads::describe(code))));
  }
}

TEST_F(SurveyTest, NamesTheOtherIndexGroupWhenThereIsNoChannel) {
  cnc.group = decoder_group - new_group_bit;
  const auto sut = wait_for(survey(*client));
  ASSERT_TRUE(sut);
  EXPECT_THAT(sut->finding, AllOf(HasSubstr("no channel found"), HasSubstr("index group 0x122301"),
                                  HasSubstr("index groups without 0x100000")));
  EXPECT_EQ(wait_for(survey(*client, {.group = cnc.group}))->channels, 1U);
}

TEST_F(SurveyTest, FindsWhichOfTheTwoGenerationsOfIndexGroupsAControllerHas) {
  EXPECT_EQ(wait_for(locate(*client, 1))->group, decoder_group);
  cnc.group = decoder_group - new_group_bit;
  EXPECT_EQ(wait_for(locate(*client, 1))->group, cnc.group);
  EXPECT_EQ(wait_for(locate(*client, 2))->group, decoder_group) << "neither has this channel";
}

TEST_F(SurveyTest, ChecksNoOtherGroupsWhereOnlyTheVariableIsMissing) {
  cnc.values.clear();
  cnc.calls.clear();
  EXPECT_EQ(wait_for(locate(*client, 1))->group, decoder_group);
  EXPECT_EQ(cnc.calls.size(), 1U);
}

TEST_F(SurveyTest, FailsForAControllerThatIsNotReady) {
  cnc.failure = ErrorCode::not_ready;
  EXPECT_EQ(wait_for(survey(*client)).error(), ErrorCode::not_ready);
}

}  // namespace
}  // namespace millrace::cnc::variables
