#include "cnc/variables/probe.hpp"

#include <gmock/gmock.h>

#include "cnc/variables/service_variable.hpp"
#include "tests/unit/variables/controller_fixture.hpp"

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
    for (const Answer& one : found.answers) {
      if (one.what == what) {
        return one;
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

}  // namespace
}  // namespace millrace::cnc::variables
