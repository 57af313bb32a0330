#include "tools/replay/matcher.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/replay/sample_plan.hpp"
#include "tools/replay/comparison.hpp"
#include "tools/replay/plan.hpp"

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

std::string differ(const std::string& recorded, const std::string& got,
                   const std::optional<Tolerance>& tolerance = std::nullopt) {
  const auto difference = compare({recorded, 1, {}}, {got, 1, {}}, tolerance);
  return difference ? difference->what : "same";
}

TEST(Comparison, IsExactByDefault) {
  EXPECT_EQ(differ("1.414214", "1.414214"), "same");
  EXPECT_EQ(differ("1.414214", "1.414213"), "the text differs");
  EXPECT_EQ(differ("1.0", "1.00"), "the text differs");
  EXPECT_EQ(compare({"1.414214", 1, {}}, {"1.414213", 1, {}}, {})->at, 7U);
  EXPECT_EQ(compare({"1.4", 1, {}}, {"1.414213", 1, {}}, {})->at, 3U);
}

TEST(Comparison, AlwaysComparesStates) {
  EXPECT_EQ(compare({"a", 1, {}}, {"a", 2, {}}, Tolerance{1, false})->what, "the state differs");
  EXPECT_EQ(compare({"a", 1, {}}, {"b", 2, {}}, {})->what,
            "the text differs, and the state differs");
}

TEST(Comparison, ComparesNumbersWithinAnAbsoluteTolerance) {
  const Tolerance tolerance{0.001, false};
  EXPECT_EQ(differ("1.414214", "1.4138", tolerance), "same");
  EXPECT_EQ(differ("D=1.0 mm, X=-2e3", "D=1.0009 mm, X=-2000", tolerance), "same");
  EXPECT_EQ(differ("1.0", "1.001", tolerance), "same");
  EXPECT_THAT(differ("1.0", "1.0011", tolerance), HasSubstr("1.0011 is not 1.0 within 0.001"));
}

TEST(Comparison, ComparesNumbersWithinAShareOfTheRecordedOne) {
  const Tolerance tolerance{0.01, true};
  EXPECT_EQ(differ("200", "202", tolerance), "same");
  EXPECT_THAT(differ("200", "203", tolerance), HasSubstr("203 is not 200 within 1 %"));
  EXPECT_EQ(differ("0", "0", tolerance), "same");
  EXPECT_NE(differ("0", "0.0001", tolerance), "same");
}

TEST(Comparison, ComparesWhatStandsBetweenNumbersByteByByte) {
  const Tolerance tolerance{1, false};
  EXPECT_EQ(differ("D=1 mm", "D=1 in", tolerance), "the text differs");
  EXPECT_EQ(differ("1", "1 mm", tolerance), "the text differs");
  EXPECT_EQ(differ("one", "two", tolerance), "the text differs");
  EXPECT_EQ(differ("", "1", tolerance), "the text differs");
  EXPECT_EQ(compare({"D=1 mm", 1, {}}, {"D=1.5 in", 1, {}}, tolerance)->at, 6U);
}

TEST(Comparison, ComparesTheSizeOfATextThatWasNotRecorded) {
  const Answer withheld{"", 1, 3};
  EXPECT_FALSE(compare(withheld, {"abc", 1, {}}, {}).has_value());
  EXPECT_THAT(compare(withheld, {"abcd", 1, {}}, {})->what, HasSubstr("had 3 bytes and has 4"));
}

TEST(Tolerances, AreForAllOrForOneService) {
  Tolerances sut;
  EXPECT_TRUE(sut.add("0.5").has_value());
  EXPECT_TRUE(sut.add("{560AACBF-6335-44A9-895A-8B27F3ED5E47}=1%").has_value());
  EXPECT_EQ(sut.of("other")->value, 0.5);
  EXPECT_EQ(sut.of(root)->value, 0.01);
  EXPECT_TRUE(sut.of(root)->relative);
  for (const char* wrong : {"", "x", "-1", "=1", "a=", "a=1x", "nan", "inf"}) {
    EXPECT_THAT(sut.add(wrong).error(), HasSubstr("is not a tolerance; expected")) << wrong;
  }
}

TEST(Judgement, NamesTheOutcomeOfACall) {
  const Tolerances exact;
  PlannedCall call = planned(1, std::chrono::milliseconds(0), std::chrono::milliseconds(5));
  const Outcome right{.answer = Answer{"1.414214", 1, {}}};
  const Outcome wrong{.answer = Answer{"1.414213", 1, {}}};
  const Outcome silent{.reason = "no answer"};
  EXPECT_EQ(judge(call, right, Side::service, &exact).verdict, Verdict::same);
  EXPECT_EQ(judge(call, wrong, Side::service, &exact).verdict, Verdict::differs);
  EXPECT_EQ(judge(call, wrong, Side::service, nullptr).verdict, Verdict::answered);
  EXPECT_EQ(judge(call, silent, Side::service, nullptr).verdict, Verdict::unanswered);
  call.settled = TimedAnswer{.answer = {"1.414213", 1, {}}};
  EXPECT_EQ(judge(call, wrong, Side::program, &exact).verdict, Verdict::same);
  EXPECT_EQ(judge(call, wrong, Side::service, &exact).verdict, Verdict::differs);
  call.settled.reset();
  call.answer.reset();
  call.withdrawn_after = std::chrono::milliseconds(3);
  EXPECT_EQ(judge(call, silent, Side::service, &exact).verdict, Verdict::withdrawn);
  EXPECT_EQ(judge(call, right, Side::service, &exact).verdict, Verdict::not_recorded);
}

TEST(ChannelMap, MapsChannelsAndWholeMachines) {
  ChannelMap sut;
  EXPECT_TRUE(sut.add("cnc/1=test/7").has_value());
  EXPECT_TRUE(sut.add("cnc=other").has_value());
  EXPECT_EQ(sut.find({"cnc", 1}), (fabric::ChannelKey{"test", 7}));
  EXPECT_EQ(sut.find({"cnc", 2}), (fabric::ChannelKey{"other", 2}));
  EXPECT_EQ(sut.find({"else", 2}), std::nullopt);
}

TEST(ChannelMap, MapsAQueueByItselfOrWithItsMachine) {
  ChannelMap sut;
  EXPECT_TRUE(sut.add("cnc.alarms/1=test/7").has_value());
  EXPECT_TRUE(sut.add("cnc=other").has_value());
  EXPECT_EQ(sut.find({"cnc.alarms", 1}), (fabric::ChannelKey{"test", 7}));
  EXPECT_EQ(sut.find({"cnc.parts", 2}), (fabric::ChannelKey{"other.parts", 2}));
}

TEST(ChannelMap, RefusesWhatMapsNothing) {
  ChannelMap sut;
  for (const char* wrong : {"", "cnc", "cnc/1", "cnc/1=test", "cnc=test/1", "cnc/0=test/1",
                            "cnc/1=test/x", "cnc/1=test/70000", "=", "a=", "=b"}) {
    EXPECT_THAT(sut.add(wrong).error(), HasSubstr("maps no channel; expected")) << wrong;
  }
  EXPECT_TRUE(sut.empty());
}

}  // namespace
}  // namespace millrace::tools::replay
