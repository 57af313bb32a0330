#include <gmock/gmock.h>

#include "cnc/variables/probe.hpp"
#include "cnc/variables/service_variable.hpp"
#include "tests/unit/variables/controller_fixture.hpp"

namespace millrace::cnc::variables {
namespace {

using ads::ErrorCode;
using testing::AllOf;
using testing::HasSubstr;

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
