#include "tools/replay/comparison.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/replay/sample_plan.hpp"
#include "tools/replay/plan.hpp"

namespace millrace::tools::replay {
namespace {

using testing::HasSubstr;

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
