// Calls that are withdrawn, requested again, or requested by gateways that come and go.
#include <gtest/gtest.h>

#include "services/sdk/instance.hpp"
#include "tests/unit/services/sdk/call_scheduler_fixture.hpp"

namespace millrace::services::sdk {
namespace {

using namespace std::chrono_literals;
using fabric::CallId;
using fabric::Reply;
using fabric::Request;
using fabric::ServiceCode;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TEST_F(CallSchedulerTest, CancelsARunningCallThatIsWithdrawnAndDropsItsAnswer) {
  started(request(1));
  const auto cancelled = only<Cancel>(sut.on_withdrawn(asked_by(1)));
  ASSERT_THAT(cancelled, SizeIs(1));
  EXPECT_EQ(cancelled.front().call, call(1));
  const Actions actions = sut.on_result(call(1), answer, now);
  EXPECT_THAT(only<Send>(actions), IsEmpty());
  EXPECT_THAT(only<Drop>(actions), SizeIs(1));
  EXPECT_EQ(sut.status().cancelled, 1U);
}

TEST_F(CallSchedulerTest, NeverStartsAWithdrawnCallThatWaits) {
  started(request(1, 1));
  started(request(2, 2));
  sut.on_withdrawn(asked_by(1, 2));
  EXPECT_THAT(only<Start>(sut.on_result(call(1), answer, now)), IsEmpty());
  EXPECT_TRUE(sut.idle());
}

TEST_F(CallSchedulerTest, IgnoresTheWithdrawalOfAnAnsweredCall) {
  started(request(1));
  answered(1, answer);
  EXPECT_THAT(sut.on_withdrawn(asked_by(1)), IsEmpty());
  EXPECT_THAT(sut.on_withdrawn(asked_by(1, 7)), IsEmpty());
}

TEST_F(CallSchedulerTest, TreatsANewCallOfTheChannelAsAWithdrawalOfTheOld) {
  started(request(1));
  EXPECT_THAT(only<Cancel>(sut.on_request(request(2), now)), SizeIs(1));
  const Actions actions = sut.on_result(call(1), answer, now);
  EXPECT_THAT(only<Send>(actions), IsEmpty());
  EXPECT_THAT(only<Start>(actions), SizeIs(1));
}

// A regression: the result of the cancelled handler went to the program as its answer.
TEST_F(CallSchedulerTest, RunsAWithdrawnCallAgainThatIsRequestedAgainWhileItRuns) {
  started(request(1));
  sut.on_withdrawn(asked_by(1));
  EXPECT_EQ(started(again(request(1), 2)), 0U);
  const Actions actions = sut.on_result(call(1), Response{.text = "anything"}, now);
  EXPECT_THAT(only<Send>(actions), IsEmpty());
  EXPECT_THAT(only<Drop>(actions), SizeIs(1));
  ASSERT_THAT(only<Start>(actions), SizeIs(1));
  EXPECT_EQ(only<Start>(actions).front().request.attempt, 2U);
  const Reply reply = answered(1, answer);
  EXPECT_EQ(reply.attempt, 2U);
  EXPECT_EQ(reply.text, "2.000000");
}

TEST_F(CallSchedulerTest, RunsAWithdrawnCallAgainThatIsRequestedAgainAfterItHasEnded) {
  started(request(1));
  sut.on_withdrawn(asked_by(1));
  sut.on_result(call(1), Response{.text = "anything"}, now);
  EXPECT_EQ(started(request(1)), 1U);
  EXPECT_EQ(answered(1, answer).text, "2.000000");
}

TEST_F(CallSchedulerTest, RunsOtherCallsWhileOneWaitsForTheEndOfItsCancelledRun) {
  CallScheduler two({.instance = self, .concurrency = 2});
  two.on_request(request(1), now);
  two.on_withdrawn(asked_by(1));
  EXPECT_THAT(only<Start>(two.on_request(request(1), now)), IsEmpty());
  EXPECT_THAT(only<Start>(two.on_request(request(2, 2), now)), SizeIs(1));
  EXPECT_THAT(only<Start>(two.on_result(call(1), answer, now)), SizeIs(1));
}

TEST_F(CallSchedulerTest, ShowsNothingOfACancelledRunWhileItsCallIsRequestedAgain) {
  started(request(1));
  sut.on_withdrawn(asked_by(1));
  started(request(1));
  EXPECT_THAT(sut.on_interim(call(1), {.text = "half", .state = 50}, now), IsEmpty());
}

TEST_F(CallSchedulerTest, DoesNotRunACallAgainThatIsWithdrawnAgain) {
  started(request(1));
  sut.on_withdrawn(asked_by(1));
  started(request(1));
  sut.on_withdrawn(asked_by(1));
  EXPECT_THAT(only<Start>(sut.on_result(call(1), answer, now)), IsEmpty());
  EXPECT_TRUE(sut.idle());
}

TEST_F(CallSchedulerTest, CountsNoAnswerOfACancelledRun) {
  started(request(1));
  sut.on_withdrawn(asked_by(1));
  sut.on_result(call(1), answer, later(4));
  EXPECT_EQ(sut.status().answered, 0U);
  EXPECT_EQ(sut.status().cancelled, 1U);
}

class OnceCallSchedulerTest : public CallSchedulerTest {
 protected:
  OnceCallSchedulerTest() {
    sut = CallScheduler({.instance = self, .delivery = fabric::Delivery::at_most_once});
  }

  static void expect_refused(const Actions& actions) {
    EXPECT_THAT(only<Start>(actions), IsEmpty());
    const auto sent = only<Send>(actions);
    ASSERT_THAT(sent, SizeIs(1));
    EXPECT_EQ(sent.front().reply.code, ServiceCode::failed);
    EXPECT_EQ(sent.front().reply.state, 500U);
    EXPECT_THAT(sent.front().reply.text, HasSubstr("must not run twice"));
  }
};

TEST_F(OnceCallSchedulerTest, AnswersAWithdrawnCallThatIsRequestedAgainWithAnError) {
  started(request(1));
  sut.on_withdrawn(asked_by(1));
  expect_refused(sut.on_request(request(1), now));
  EXPECT_THAT(only<Send>(sut.on_result(call(1), answer, now)), IsEmpty());
  expect_refused(sut.on_request(request(1), now));
}

TEST_F(OnceCallSchedulerTest, RunsAWithdrawnCallAgainThatAnOperatorRetries) {
  started(request(1));
  sut.on_withdrawn(asked_by(1));
  EXPECT_EQ(started(again(request(1), 2)), 0U);
  EXPECT_THAT(only<Start>(sut.on_result(call(1), answer, now)), SizeIs(1));
  EXPECT_EQ(answered(1, answer).attempt, 2U);
}

TEST_F(OnceCallSchedulerTest, RunsACallThatWasWithdrawnBeforeItRan) {
  started(request(1, 1));
  started(request(2, 2));
  sut.on_withdrawn(asked_by(1, 2));
  started(request(2, 2));
  EXPECT_THAT(only<Start>(sut.on_result(call(1), answer, now)), SizeIs(1));
}

// A regression: the gateway that released its call cancelled the other's too, and a program waited
// for ever. Found by the simulation.
TEST_F(CallSchedulerTest, WithdrawsNoCallOfAnotherGateway) {
  started(request(1));
  EXPECT_THAT(sut.on_withdrawn(asked_by(2)), IsEmpty());
  EXPECT_EQ(answered(1, answer).text, "2.000000");
}

TEST_F(CallSchedulerTest, AnswersTwoGatewaysThatBothHaveTheChannel) {
  ASSERT_EQ(started(request(1)), 1U);
  EXPECT_THAT(only<Cancel>(sut.on_request(of_another_gateway(1), now)), IsEmpty());
  const auto first = sut.on_result(call(1), answer, now);
  EXPECT_THAT(only<Send>(first), SizeIs(1));
  ASSERT_THAT(only<Start>(first), SizeIs(1));
  const CallId other_call = only<Start>(first).front().request.call;
  EXPECT_EQ(other_call, of_another_gateway(1).call);
  EXPECT_THAT(only<Send>(sut.on_result(other_call, answer, now)), SizeIs(1));
}

TEST_F(CallSchedulerTest, AnswersACallWhoseGatewayIsGone) {
  started(request(1));
  EXPECT_THAT(sut.on_orphaned(asked_by(1)), IsEmpty());
  EXPECT_EQ(answered(1, answer).text, "2.000000");
}

TEST_F(CallSchedulerTest, StartsAWaitingCallWhoseGatewayIsGone) {
  started(request(1, 1));
  started(request(2, 2));
  sut.on_orphaned(asked_by(1, 2));
  EXPECT_THAT(only<Start>(sut.on_result(call(1), answer, now)), SizeIs(1));
}

TEST_F(CallSchedulerTest, GivesUpTheCallOfAGatewayThatIsGoneOnceAnotherRequestsIt) {
  started(request(1));
  sut.on_orphaned(asked_by(1));
  const auto cancelled = only<Cancel>(sut.on_request(of_another_gateway(1), now));
  ASSERT_THAT(cancelled, SizeIs(1));
  EXPECT_EQ(cancelled.front().call, call(1));
}

// A gateway without a journal on disk restarts before its lease is over.
TEST_F(CallSchedulerTest, GivesUpTheCallOfAGatewayThatGoesAfterAnotherRequestedIt) {
  started(request(1));
  sut.on_request(of_another_gateway(1), now);
  EXPECT_THAT(only<Cancel>(sut.on_orphaned(asked_by(1))), SizeIs(1));
}

TEST_F(CallSchedulerTest, KeepsTheCallOfAGatewayThatGoesAfterTheOtherOneWent) {
  started(request(1));
  sut.on_request(of_another_gateway(1), now);
  sut.on_orphaned(asked_by(2));
  EXPECT_THAT(sut.on_orphaned(asked_by(1)), IsEmpty());
  EXPECT_EQ(answered(1, answer).text, "2.000000");
}

TEST_F(CallSchedulerTest, KeepsTheCallOfAGatewayThatReturnedBeforeAnotherRequestsIt) {
  started(request(1));
  sut.on_orphaned(asked_by(1));
  sut.on_request(request(1), now);
  EXPECT_THAT(only<Cancel>(sut.on_request(of_another_gateway(1), now)), IsEmpty());
}

TEST_F(CallSchedulerTest, AnswersAGatewayThatReturnsAfterItsCallWasGivenUp) {
  started(request(1));
  sut.on_orphaned(asked_by(1));
  sut.on_request(of_another_gateway(1), now);
  sut.on_request(again(request(1), 2), now);
  const auto next = only<Start>(sut.on_result(call(1), answer, now));
  ASSERT_THAT(next, SizeIs(1));
  ASSERT_EQ(next.front().request.call, of_another_gateway(1).call);
  const auto after = only<Start>(sut.on_result(of_another_gateway(1).call, answer, now));
  ASSERT_THAT(after, SizeIs(1));
  EXPECT_EQ(after.front().request.call, call(1));
  EXPECT_EQ(answered(1, answer).attempt, 2U);
}

/// A participant that knows the ids of the calls of others.
class AStranger : public CallSchedulerTest {
 protected:
  static fabric::Request of_a_stranger(fabric::Request request, const std::string& text) {
    request.requester = 666;
    request.text = text;
    return request;
  }
  static fabric::RequestKey key_of_a_stranger() {
    fabric::RequestKey key = asked_by(1);
    key.requester = 666;
    return key;
  }
};

// A regression: it was run and remembered, and its answer "repeated" to the real one: 2,346 of
// 4,838 calls were wrong.
TEST_F(AStranger, ThatRequestsSomethingElseUnderACallIdGivesNoAnswerToItsOwner) {
  started(of_a_stranger(request(1), "9"));
  EXPECT_EQ(answered(1, Response{.text = "3.000000"}).asked_text, "9");
  EXPECT_EQ(started(request(1)), 1U);
  const Reply reply = answered(1, answer);
  EXPECT_EQ(reply.code, ServiceCode::ok);
  EXPECT_EQ(reply.text, "2.000000");
  EXPECT_EQ(reply.asked_text, "");
}

TEST_F(AStranger,
       ThatRequestsTheSameUnderACallIdGivesNoAnswerToItsOwnerWhereRequestersAreAuthenticated) {
  sut = CallScheduler({.instance = self, .authenticated_requesters = true});
  started(of_a_stranger(request(1), ""));
  answered(1, Response{.text = "3.000000"});
  EXPECT_EQ(started(request(1)), 1U);
}

TEST_F(AStranger, ThatRequestsUnderTheIdOfARunningCallRunsAfterIt) {
  CallScheduler two({.instance = self, .concurrency = 2});
  two.on_request(request(1), now);
  EXPECT_THAT(two.on_request(of_a_stranger(request(1), "9"), now), IsEmpty());
  const auto next = two.on_result(call(1), answer, now);
  ASSERT_THAT(only<Send>(next), SizeIs(1));
  EXPECT_EQ(only<Send>(next).front().reply.asked_text, "");
  ASSERT_THAT(only<Start>(next), SizeIs(1));
  EXPECT_EQ(only<Start>(next).front().request.text, "9");
}

// A regression: the handler of a running call was cancelled.
TEST_F(AStranger, ThatWithdrawsItsOwnWaitingCallCancelsNoHandlerOfTheSameId) {
  started(request(1));
  started(of_a_stranger(request(1), "9"));
  const auto cancelled = only<Cancel>(sut.on_withdrawn(key_of_a_stranger()));
  ASSERT_THAT(cancelled, SizeIs(1));
  EXPECT_FALSE(cancelled.front().runs);
  EXPECT_EQ(answered(1, answer).text, "2.000000");
}

TEST_F(AStranger, WithdrawsNoCallOfOthers) {
  started(request(1));
  EXPECT_THAT(sut.on_withdrawn(key_of_a_stranger()), IsEmpty());
  EXPECT_EQ(answered(1, answer).text, "2.000000");
}

TEST_F(AStranger, ThatRequestsTheSameAndWithdrawsItCancelsNothing) {
  started(request(1));
  started(of_a_stranger(request(1), ""));
  EXPECT_THAT(sut.on_withdrawn(key_of_a_stranger()), IsEmpty());
  EXPECT_EQ(answered(1, answer).text, "2.000000");
}

// A regression: a number one higher made the instance give up the running call.
TEST_F(AStranger, WithALaterNumberOrTheEpochOfASuccessorGivesUpNoCallOfOthers) {
  started(request(1));
  EXPECT_THAT(only<Cancel>(sut.on_request(of_a_stranger(request(2), "9"), now)), IsEmpty());
  Request successor = of_a_stranger(of_another_gateway(3), "9");
  successor.succeeds = 1;
  // Its own call, which waited.
  EXPECT_THAT(only<Cancel>(sut.on_request(successor, now)),
              testing::Each(testing::Field(&Cancel::runs, false)));
  EXPECT_EQ(answered(1, answer).text, "2.000000");
}

// A restarted gateway has a new writer.
TEST_F(AStranger, ThatRequestsTheSameGetsTheAnswerFromMemory) {
  started(request(1));
  answered(1, answer);
  const auto sent = only<Send>(sut.on_request(of_a_stranger(request(1), ""), now));
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_EQ(sent.front().reply.code, ServiceCode::repeated);
}

TEST_F(AStranger, ReplacesNoAnswerOfOthersInMemory) {
  sut = CallScheduler({.instance = self, .memory = 8});
  started(request(1));
  answered(1, answer);
  for (std::uint64_t number = 2; number <= 50; ++number) {
    started(of_a_stranger(request(number), "9"));
    answered(number, answer);
  }
  EXPECT_THAT(only<Send>(sut.on_request(again(request(1), 2), now)), SizeIs(1));
}

TEST(CallSummary, CountsTheCallsSinceTheLastOne) {
  const fabric::InstanceStatus before{.answered = 1000, .failed = 4, .cancelled = 1};
  const fabric::InstanceStatus now{.answered = 61'000, .failed = 6, .cancelled = 1};
  EXPECT_EQ(call_summary(before, now, 60s), "60000 calls answered in 60 s, 2 with an error");
}

TEST(CallSummary, CountsCallsWithoutAnAnswerToo) {
  const fabric::InstanceStatus now{
      .running = 1, .answered = 1, .repeated = 2, .cancelled = 3, .declined = 4};
  EXPECT_EQ(
      call_summary({}, now, 7s),
      "1 call answered in 7 s, 2 again from memory, 3 withdrawn, 4 declined, 1 still running");
}

TEST(CallSummary, IsThereWhereCallsWereOnlyWithdrawn) {
  EXPECT_EQ(call_summary({}, {.cancelled = 1}, 60s), "0 calls answered in 60 s, 1 withdrawn");
}

TEST(CallSummary, IsAbsentAfterAQuietMinute) {
  const fabric::InstanceStatus now{.running = 1, .answered = 7};
  EXPECT_EQ(call_summary(now, now, 60s), std::nullopt);
}

}  // namespace
}  // namespace millrace::services::sdk
