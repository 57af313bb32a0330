#include "tools/replay/plan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"
#include "tests/unit/tools/replay/sample_plan.hpp"
#include "tools/replay/data_plan.hpp"

namespace millrace::tools::replay {
namespace {

using namespace std::chrono_literals;
using fabric::ProgramEvent;
using fabric::ProgramEventKind;
using recording::Entry;
using recording::tests::at;
using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TEST(Plan, HasEachCallWithItsAnswerAndTimes) {
  PlanBuilder sut;
  sut.add(entry(0ms, request_entry(1)));
  sut.add(entry(5ms, reply_entry(1)));
  sut.add(entry(100ms, request_entry(2, 2)));
  sut.add(entry(103ms, reply_entry(2, "2", 2)));
  const Plan plan = sut.build();
  ASSERT_THAT(plan.calls, SizeIs(2));
  EXPECT_EQ(plan.calls[0].at, 0ms);
  EXPECT_EQ(plan.calls[0].answer->answer.text, "1.414214");
  EXPECT_EQ(plan.calls[0].answer->after, 5ms);
  EXPECT_EQ(plan.calls[1].channel.channel, 2);
  EXPECT_EQ(plan.calls[1].at, 100ms);
  EXPECT_EQ(plan.calls[1].end(), 103ms);
  EXPECT_EQ(plan.length(), 100ms);
}

TEST(Plan, UsesTheTimeOfTheRequestAndNotOfItsDispatch) {
  PlanBuilder sut;
  sut.add(entry(0ms, request_entry(1)));
  fabric::Request waited = request_entry(2, 2);
  // By the gateway's own clock, which may have any time.
  waited.seen = fabric::Time(1000s);
  waited.dispatched = fabric::Time(1000s + 30ms);
  sut.add(entry(100ms, waited));
  const Plan plan = sut.build();
  EXPECT_EQ(plan.calls[1].at, 70ms);
}

TEST(Plan, HasACallOnceThatWasDispatchedTwice) {
  PlanBuilder sut;
  sut.add(entry(0ms, request_entry(1)));
  sut.add(entry(50ms, recording::Withdrawal{.key = {"cnc", 1}, .call = {7, 1}}));
  fabric::Request second = request_entry(1);
  second.attempt = 2;
  sut.add(entry(51ms, second));
  sut.add(entry(60ms, reply_entry(1)));
  const Plan plan = sut.build();
  ASSERT_THAT(plan.calls, SizeIs(1));
  EXPECT_EQ(plan.calls[0].at, 0ms);
  EXPECT_EQ(plan.calls[0].answer->after, 60ms);
  EXPECT_EQ(plan.calls[0].withdrawn_after, std::nullopt);
}

// It is unanswered: it was under way when the recording ended.
TEST(Plan, KeepsACallThatWasWithdrawnAndDispatchedAgain) {
  PlanBuilder sut;
  sut.add(entry(0ms, request_entry(1)));
  sut.add(entry(50ms, recording::Withdrawal{.key = {"cnc", 1}, .call = {7, 1}}));
  fabric::Request second = request_entry(1);
  second.attempt = 2;
  sut.add(entry(51ms, second));
  const Plan plan = sut.build();
  ASSERT_THAT(plan.calls, SizeIs(1));
  EXPECT_EQ(plan.calls[0].withdrawn_after, std::nullopt);
  EXPECT_EQ(plan.calls[0].end(), std::nullopt);
}

TEST(Plan, IgnoresAWithdrawalAfterTheReply) {
  PlanBuilder sut;
  sut.add(entry(0ms, request_entry(1)));
  // The recorder may receive them in either order.
  sut.add(entry(5ms, recording::Withdrawal{.key = {"cnc", 1}, .call = {7, 1}}));
  sut.add(entry(5ms, reply_entry(1)));
  EXPECT_EQ(sut.build().calls[0].withdrawn_after, std::nullopt);
}

TEST(Plan, DetectsACallThatItsProgramGaveUpEvenIfTheServiceAnsweredLater) {
  PlanBuilder sut;
  sut.add(entry(0ms, request_entry(1)));
  sut.add(entry(
      20ms,
      fabric::Event{.key = {"cnc", 1}, .call = {7, 1}, .kind = fabric::EventKind::withdrawn}));
  sut.add(entry(40ms, reply_entry(1)));
  const Plan plan = sut.build();
  EXPECT_FALSE(plan.calls[0].answer.has_value());
  EXPECT_EQ(plan.calls[0].withdrawn_after, 20ms);
}

TEST(Plan, SeparatesTheAnswerOfTheServiceFromThatToTheProgram) {
  PlanBuilder sut;
  sut.add(entry(0ms, request_entry(1)));
  sut.add(entry(20ms, fabric::Event{.key = {"cnc", 1},
                                    .call = {7, 1},
                                    .kind = fabric::EventKind::written,
                                    .text = "by hand",
                                    .state = 9}));
  const Plan plan = sut.build();
  EXPECT_FALSE(plan.calls[0].answer.has_value());
  ASSERT_TRUE(plan.calls[0].settled.has_value());
  EXPECT_EQ(plan.calls[0].settled->answer, (Answer{"by hand", 9, std::nullopt}));

  PlanBuilder usual;
  usual.add(entry(0ms, request_entry(1)));
  usual.add(entry(1ms, reply_entry(1)));
  usual.add(entry(2ms, fabric::Event{.key = {"cnc", 1},
                                     .call = {7, 1},
                                     .kind = fabric::EventKind::written,
                                     .text = "1.414214",
                                     .state = 1}));
  EXPECT_FALSE(usual.build().calls[0].settled.has_value());
}

TEST(Plan, UsesTheFirstOfRepeatedRepliesAndEachInterimOne) {
  PlanBuilder sut;
  sut.add(entry(0ms, request_entry(1)));
  fabric::Reply half = reply_entry(1, "half");
  half.kind = fabric::ReplyKind::interim;
  sut.add(entry(1ms, half));
  sut.add(entry(2ms, half));
  sut.add(entry(3ms, reply_entry(1, "done")));
  sut.add(entry(9ms, reply_entry(1, "done again")));
  const PlannedCall call = sut.build().calls.at(0);
  EXPECT_THAT(call.interim, SizeIs(1));
  EXPECT_EQ(call.answer->answer.text, "done");
}

TEST(Plan, UsesTheAnswerOfTheInstanceThatRanACallAnotherOneDeclined) {
  PlanBuilder sut;
  sut.add(entry(0ms, request_entry(1)));
  fabric::Reply declined = reply_entry(1, "it runs at most 1 calls at once", 1);
  declined.kind = fabric::ReplyKind::declined;
  declined.state = 0;
  sut.add(entry(1ms, declined));
  sut.add(entry(9ms, reply_entry(1, "done")));
  const PlannedCall call = sut.build().calls.at(0);
  EXPECT_THAT(call.interim, IsEmpty());
  ASSERT_TRUE(call.answer);
  EXPECT_EQ(call.answer->answer.text, "done");
  EXPECT_EQ(call.answer->answer.state, 1U);
}

TEST(Plan, UsesAReplyThatWasRecordedBeforeItsRequest) {
  PlanBuilder sut;
  sut.add(entry(0ms, reply_entry(1)));
  sut.add(entry(1ms, request_entry(1)));
  const Plan plan = sut.build();
  ASSERT_TRUE(plan.calls.at(0).answer.has_value());
  EXPECT_EQ(plan.calls[0].answer->after, 0ms);
}

TEST(Plan, UsesTheGatewaysEventsForACallWhoseRequestIsMissing) {
  PlanBuilder sut;
  const auto event = [](fabric::EventKind kind, const std::string& text) {
    return fabric::Event{
        .key = {"cnc", 1}, .call = {7, 1}, .kind = kind, .uuid = root, .text = text, .state = 1};
  };
  sut.add(entry(0ms, event(fabric::EventKind::seen, "2")));
  sut.add(entry(3ms, event(fabric::EventKind::replied, "1.414214")));
  sut.add(entry(4ms, event(fabric::EventKind::written, "1.414214")));
  const PlannedCall call = sut.build().calls.at(0);
  EXPECT_EQ(call.text, "2");
  EXPECT_EQ(call.uuid, root);
  EXPECT_EQ(call.answer->answer.text, "1.414214");
  EXPECT_EQ(call.answer->after, 3ms);
  EXPECT_FALSE(call.settled.has_value());
}

TEST(Plan, LeavesOutRepliesWithoutARequest) {
  PlanBuilder sut;
  sut.add(entry(0ms, reply_entry(1)));
  EXPECT_THAT(sut.build().calls, IsEmpty());
}

TEST(Plan, FiltersRequestsAndKeepsTheirReplies) {
  recording::Filter filter;
  filter.to = recorded_at(50ms);
  PlanBuilder sut(filter);
  sut.add(entry(40ms, request_entry(1)));
  sut.add(entry(60ms, reply_entry(1)));
  sut.add(entry(70ms, request_entry(2)));
  const Plan plan = sut.build();
  ASSERT_THAT(plan.calls, SizeIs(1));
  EXPECT_TRUE(plan.calls[0].answer.has_value());
}

TEST(Plan, CutsLongGaps) {
  PlanBuilder sut;
  sut.add(entry(0s, request_entry(1)));
  sut.add(entry(100s, request_entry(2)));
  sut.add(entry(101s, request_entry(3)));
  sut.add(entry(500s, request_entry(4)));
  const Plan plan = sut.build({.max_gap = 5s});
  EXPECT_EQ(plan.calls[1].at, 5s);
  EXPECT_EQ(plan.calls[2].at, 6s);
  EXPECT_EQ(plan.calls[3].at, 11s);
}

TEST(Plan, NamesCallsWhoseTextWasNotRecorded) {
  PlanBuilder sut;
  recording::Entry mail = entry(0ms, request_entry(1));
  recording::withhold_text(mail);
  sut.add(mail);
  const Plan plan = sut.build();
  EXPECT_THAT(plan.calls, IsEmpty());
  ASSERT_THAT(plan.skipped, SizeIs(1));
  EXPECT_THAT(plan.skipped[0].reason, HasSubstr("not in the recording"));
}

TEST(Plan, LeavesOutImpossibleRequests) {
  PlanBuilder sut;
  fabric::Request request = request_entry(1);
  request.state = 0;
  sut.add(entry(0ms, request));
  request = request_entry(2);
  request.text.assign(128, 'x');
  sut.add(entry(1ms, request));
  request = request_entry(3);
  request.uuid.push_back('\0');
  sut.add(entry(2ms, request));
  const Plan plan = sut.build();
  EXPECT_THAT(plan.calls, IsEmpty());
  EXPECT_THAT(plan.skipped, SizeIs(3));
}

const fabric::ChannelKey press{"press", 1};
const fabric::ChannelKey test{"test", 7};

fabric::DataSample sample(double ms) {
  return {.key = press,
          .group = "axes",
          .at = at(ms),
          .values = {{.name = "X", .at = at(ms - 5), .elements = std::vector<double>{1}}}};
}

ProgramEvent event(ProgramEventKind kind, double ms, double started) {
  return {.key = press, .kind = kind, .at = at(ms), .started = at(started)};
}

DataPlan plan_of(const std::vector<double>& times, Pace pace = {}, milliseconds max_gap = {}) {
  DataPlan plan(pace, max_gap);
  for (const double ms : times) {
    plan.add(Entry{.at = at(ms), .sample = sample(ms)});
  }
  return plan;
}

TEST(ADataPlan, CountsWhatItIsAbout) {
  DataPlan sut({});
  sut.add({.at = at(0), .sample = sample(0)});
  sut.add({.at = at(1), .sample = event(ProgramEventKind::ended, 1, 0)});
  sut.add({.at = at(2), .sample = fabric::Request{.key = {"other", 1}}});
  EXPECT_EQ(sut.samples(), 1U);
  EXPECT_EQ(sut.events(), 1U);
  EXPECT_THAT(sut.channels(), ElementsAre(press));
}

TEST(ADataPlan, KeepsTheRecordedTiming) {
  const DataPlan sut = plan_of({1000, 1100, 1300});
  EXPECT_EQ(sut.due(at(1000)), milliseconds(0));
  EXPECT_EQ(sut.due(at(1300)), milliseconds(300));
}

TEST(ADataPlan, IsFasterOnRequest) {
  EXPECT_EQ(plan_of({1000, 1300}, {.rate = 10}).due(at(1300)), milliseconds(30));
  EXPECT_EQ(plan_of({1000, 1300}, {.timing = Timing::fast}).due(at(1300)), milliseconds(0));
}

TEST(ADataPlan, CutsLongTimesWithoutAnything) {
  const DataPlan sut = plan_of({0, 100, 60'100, 60'200}, {}, milliseconds(1000));
  EXPECT_EQ(sut.due(at(100)), milliseconds(100));
  EXPECT_EQ(sut.due(at(60'100)), milliseconds(1100));
  EXPECT_EQ(sut.due(at(60'200)), milliseconds(1200));
}

TEST(ADataPlan, MovesAllTimesOfASampleToWhenItIsSent) {
  const DataPlan plan = plan_of({1000, 3000}, {.rate = 2});
  const fabric::DataSample sut = plan.replayed(sample(3000), test, at(100'000));
  EXPECT_EQ(sut.key, test);
  EXPECT_TRUE(sut.replayed);
  EXPECT_EQ(sut.at, at(101'000));
  EXPECT_EQ(sut.values.at(0).at, at(101'000 - 2.5));
  fabric::DataSample never = sample(3000);
  never.values.at(0).at = {};
  EXPECT_EQ(plan.replayed(never, test, at(100'000)).values.at(0).at, fabric::Time{});
}

TEST(ADataPlan, KeepsTheSameStartInEachEventOfARun) {
  const DataPlan plan = plan_of({1000, 60'000}, {.rate = 3}, milliseconds(500));
  const auto started =
      plan.replayed(event(ProgramEventKind::started, 1000, 1000), test, at(100'000));
  const auto ended = plan.replayed(event(ProgramEventKind::ended, 60'000, 1000), test, at(100'000));
  EXPECT_EQ(started.at, at(100'000));
  EXPECT_EQ(ended.started, started.at);
}

TEST(ADataPlan, SendsNothingFromTheFutureWhenItIsFast) {
  const DataPlan plan = plan_of({1000, 3000}, {.timing = Timing::fast});
  EXPECT_EQ(plan.replayed(sample(3000), test, at(100'000)).at, at(100'000));
  EXPECT_EQ(plan.replayed(sample(1000), test, at(100'000)).at, at(98'000));
}

TEST(ValuesOfAReplay, AreRetracted) {
  PublishedValues sut;
  sut.add(sample(0));
  sut.add(sample(100));
  sut.add(event(ProgramEventKind::started, 0, 0));
  ASSERT_THAT(sut.groups(), SizeIs(1));
  EXPECT_EQ(sut.groups().at(0).group, "axes");
  ASSERT_THAT(sut.resets(at(500)), SizeIs(1));
  EXPECT_EQ(sut.resets(at(500)).at(0).kind, ProgramEventKind::reset);
  EXPECT_EQ(sut.resets(at(500)).at(0).at, at(500));
  EXPECT_EQ(sut.resets(at(500)).at(0).started, at(0));

  sut.add(event(ProgramEventKind::ended, 100, 0));
  EXPECT_THAT(sut.resets(at(500)), IsEmpty());
  EXPECT_THAT(sut.programs(), SizeIs(1));
  fabric::DataSample gone = sample(200);
  gone.values.clear();
  sut.add(gone);
  EXPECT_THAT(sut.groups(), IsEmpty());
}

}  // namespace
}  // namespace millrace::tools::replay
