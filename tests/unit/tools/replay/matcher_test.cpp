#include "tools/replay/matcher.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/replay/sample_plan.hpp"

namespace millrace::tools::replay {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;
using testing::Le;
using testing::SizeIs;

const std::map<fabric::ChannelKey, fabric::ChannelKey> as_recorded{{{"cnc", 1}, {"cnc", 1}},
                                                                   {{"cnc", 2}, {"cnc", 2}}};

class MatcherTest : public testing::Test {
 protected:
  fabric::Request live(const std::string& text, std::uint16_t channel = 1) {
    return {.key = {"cnc", channel}, .call = {9, ++number}, .uuid = root, .text = text, .state = 1};
  }

  const Plan plan{{planned(1, 0ms, 5ms, "2", "1.4"), planned(2, 1ms, 5ms, "9", "3"),
                   planned(1, 10ms, 5ms, "4", "2")},
                  {}};
  std::uint64_t number = 0;
};

TEST_F(MatcherTest, GivesEachChannelItsCallsInOrder) {
  Matcher sut(plan, as_recorded);
  EXPECT_EQ(std::get<Matched>(sut.on_request(live("2"))).call, 0U);
  EXPECT_EQ(std::get<Matched>(sut.on_request(live("4"))).call, 2U);
  EXPECT_FALSE(sut.complete());
  EXPECT_EQ(sut.missing(), 1U);
  EXPECT_EQ(std::get<Matched>(sut.on_request(live("9", 2))).call, 1U);
  EXPECT_TRUE(sut.complete());
}

TEST_F(MatcherTest, GivesARepeatedCallTheSameAnswer) {
  Matcher sut(plan, as_recorded);
  fabric::Request request = live("2");
  EXPECT_FALSE(std::get<Matched>(sut.on_request(request)).repeated);
  request.attempt = 2;
  const Matched again = std::get<Matched>(sut.on_request(request));
  EXPECT_EQ(again.call, 0U);
  EXPECT_TRUE(again.repeated);
}

TEST_F(MatcherTest, ReportsRequestAndNextExpectedAnswerOfADifferentCall) {
  Matcher sut(plan, as_recorded);
  const Mismatch mismatch = std::get<Mismatch>(sut.on_request(live("3")));
  EXPECT_THAT(
      mismatch.reason,
      AllOf(HasSubstr("the text differs"), HasSubstr("call 1 of 2"), HasSubstr("\"2\" state 1"),
            HasSubstr("answered \"1.4\" state 1"), HasSubstr("the request was \"3\"")));
  EXPECT_EQ(mismatch.text, "ERROR: replay: call 1 of 2 asks \"2\"");
  // The next one is still expected.
  EXPECT_EQ(std::get<Matched>(sut.on_request(live("2"))).call, 0U);
}

TEST_F(MatcherTest, ComparesServiceAndStateToo) {
  Matcher sut(plan, as_recorded);
  fabric::Request other = live("2");
  other.uuid = "00000000-0000-0000-0000-000000000000";
  EXPECT_THAT(std::get<Mismatch>(sut.on_request(other)).reason, HasSubstr("the service differs"));
  fabric::Request state = live("2");
  state.state = 2;
  EXPECT_THAT(std::get<Mismatch>(sut.on_request(state)).reason, HasSubstr("the state differs"));
  fabric::Request written_otherwise = live("2");
  written_otherwise.uuid = "{560AACBF-6335-44A9-895A-8B27F3ED5E47}";
  EXPECT_EQ(std::get<Matched>(sut.on_request(written_otherwise)).call, 0U);
}

TEST_F(MatcherTest, EndsAfterItsRoundsAndNeverWithoutAnEnd) {
  Matcher twice(plan, as_recorded, 2);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(std::get<Matched>(twice.on_request(live("9", 2))).call, 1U);
  }
  EXPECT_THAT(std::get<Mismatch>(twice.on_request(live("9", 2))).reason,
              HasSubstr("no more calls of cnc/2"));
  EXPECT_EQ(twice.missing(), 4U);
  Matcher endless(plan, as_recorded, 0);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(std::get<Matched>(endless.on_request(live("9", 2))).call, 1U);
  }
  EXPECT_FALSE(endless.complete());
}

TEST_F(MatcherTest, AnswersChannelsThatWereNotRecordedWithAnError) {
  Matcher sut(plan, as_recorded);
  EXPECT_THAT(std::get<Mismatch>(sut.on_request(live("2", 3))).reason,
              HasSubstr("no call of cnc/3 is recorded"));
}

TEST_F(MatcherTest, FitsItsErrorsIntoAnAnswer) {
  Plan lengthy = plan;
  lengthy.calls[0].text.assign(127, 'x');
  Matcher sut(lengthy, as_recorded);
  const Mismatch mismatch = std::get<Mismatch>(sut.on_request(live("2")));
  EXPECT_THAT(mismatch.text, SizeIs(Le(fabric::max_text)));
  EXPECT_THAT(mismatch.reason, HasSubstr(std::string(127, 'x')));
}

TEST_F(MatcherTest, MapsALiveChannelToTheRecordedOne) {
  Matcher sut(plan, {{{"cnc", 1}, {"test", 5}}, {{"cnc", 2}, {"test", 6}}});
  fabric::Request request = live("2");
  request.key = {"test", 5};
  EXPECT_EQ(std::get<Matched>(sut.on_request(request)).call, 0U);
}

}  // namespace
}  // namespace millrace::tools::replay
