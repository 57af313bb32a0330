// The answer of a program that no service answers: the configured rules, and the operator.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/messages/catalogue.hpp"
#include "tests/unit/gateway/channel_fixture.hpp"

namespace millrace::gateway {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;
using enum fabric::EventKind;

class ChannelDeadline : public testing::Test {
 protected:
  channel::Channel& sut() { return *fixture.sut; }
  void expect_answer(const std::string& text, std::uint32_t state) {
    EXPECT_THAT(fixture.writes, ElementsAre("RESPONSE=" + text, "REQUEST_STATE=0",
                                            fmt::format("RESPONSE_STATE={}", state)));
    EXPECT_EQ(sut().call(), nullptr);
    EXPECT_THAT(fixture.journal_state.open_calls(), IsEmpty());
  }
  ChannelFixture fixture;
};

TEST_F(ChannelDeadline, IsEndlessByDefault) {
  fixture.dispatched_call();
  fixture.wait(1h);
  EXPECT_THAT(fixture.writes, IsEmpty());
  EXPECT_NE(sut().call(), nullptr);
}

TEST_F(ChannelDeadline, WithAnUnservedRequestEndsWithAnotherOffer) {
  fixture.policy.unserved = Rule{5s, 901};
  fixture.served = false;
  fixture.link_up();
  fixture.call();
  fixture.wait(4s);
  EXPECT_EQ(fixture.offers, 1U);
  fixture.wait(2s);
  EXPECT_EQ(fixture.offers, 2U);
  EXPECT_TRUE(fixture.deadline_passed);
  fixture.wait(1min);
  EXPECT_EQ(fixture.offers, 2U) << "it is offered once more, not again and again";
}

TEST_F(ChannelDeadline, WithAnUnservedRequestStartsOverWithTheNextOne) {
  fixture.policy.unserved = Rule{5s, 901};
  fixture.served = false;
  fixture.link_up();
  fixture.call("first");
  fixture.wait(4s);
  fixture.call("second", 2);
  fixture.wait(4s);
  EXPECT_FALSE(fixture.deadline_passed);
}

TEST_F(ChannelDeadline, WithAnUnservedRequestShowsItAsUnservedWhileItIsOfferedAgain) {
  fixture.policy.unserved = Rule{5s, 901};
  fixture.served = false;
  fixture.link_up();
  fixture.call();
  fixture.wait(4s);
  fixture.states.clear();
  fixture.wait(2s);
  EXPECT_EQ(fixture.offers, 2U);
  EXPECT_THAT(fixture.states, IsEmpty());
}

TEST_F(ChannelDeadline, WithAnUnservedRequestIsNoDeadlineOfTheOneThatReplacesIt) {
  fixture.policy.unserved = Rule{5s, 901};
  fixture.served = false;
  fixture.link_up();
  fixture.call("first");
  fixture.wait(1s);
  const fabric::Time seen_at = fixture.events.front().at;
  fixture.before_action = [&] {
    // Just before the reads that offer the first one again.
    if (fixture.now.wall >= seen_at + 5s && fixture.offers == 1) {
      fixture.call("second", 2);
    }
  };
  fixture.wait(5s);
  EXPECT_EQ(fixture.offers, 2U);
  EXPECT_FALSE(fixture.deadline_passed);
}

// A regression: its waiting time counted on, and the next request without a service was answered at
// once.
TEST_F(ChannelDeadline, WithAnUnservedRequestEndsOnceAServiceHasItsCall) {
  fixture.policy.unserved = Rule{5s, 901};
  fixture.served = false;
  fixture.link_up();
  fixture.call("first");
  fixture.wait(1s);
  fixture.served = true;
  sut().offer_again(fixture.now);
  fixture.wait(1s);
  ASSERT_NE(sut().call(), nullptr);
  fixture.assign();
  fixture.wait(10s);
  fixture.receive(fixture.reply("1.4", 1));
  fixture.wait(1s);
  fixture.served = false;
  fixture.call("second", 2);
  fixture.wait(1s);
  EXPECT_EQ(fixture.offers, 3U);
  EXPECT_FALSE(fixture.deadline_passed);
}

TEST_F(ChannelDeadline, EndsAtTheDeadlineWithTheConfiguredState) {
  fixture.policy.deadline = Rule{30s, 902};
  fixture.dispatched_call();
  EXPECT_EQ(fixture.published.front().deadline, fixture.published.front().seen + 30s);
  fixture.wait(29s);
  EXPECT_THAT(fixture.writes, IsEmpty());
  fixture.wait(2s);
  expect_answer("millrace: no response within 30 s", 902);
  EXPECT_THAT(fixture.withdrawn, ElementsAre(instance(1)));
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(seen, dispatched, replied, written));
  EXPECT_EQ(fixture.events[2].detail, "answered by the gateway");
}

TEST_F(ChannelDeadline, IsReportedOverAtADeadlineWithoutAState) {
  fixture.policy.deadline = Rule{1500ms, 0};
  fixture.dispatched_call();
  fixture.wait(10s);
  EXPECT_THAT(fixture.writes, IsEmpty());
  EXPECT_EQ(sut().status().reason, "no response within 1.5 s; the NC program goes on waiting");
  EXPECT_EQ(sut().status().reason.code, "deadline");
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(seen, dispatched, late));
}

TEST_F(ChannelDeadline, OfABlockedCallHasItsOwnCauseAndIsReportedOnce) {
  fixture.policy.lost = Rule{2s, 0};
  fixture.delivery = fabric::Delivery::at_most_once;
  fixture.dispatched_call();
  fixture.suspend(base::messages::instance_lost_held("sq1"), true);
  EXPECT_EQ(sut().status().reason.code, "instance_lost_held");
  fixture.wait(3s);
  EXPECT_THAT(fixture.writes, IsEmpty());
  EXPECT_EQ(sut().status().reason.code, "held_too_long");
  EXPECT_EQ(sut().status().state, fabric::ChannelState::held);
  // A regression: it was logged at each read. Found by the simulation.
  fixture.wait(1min);
  EXPECT_EQ(std::ranges::count(fixture.events, late, &fabric::Event::kind), 1);
}

TEST_F(ChannelDeadline, WithACallThatWasNeverDispatchedIsJournaledToo) {
  fixture.policy.deadline = Rule{1s, 902};
  fixture.link_up();
  fixture.call();
  fixture.wait(900ms);
  fixture.before_action = [&] { fixture.stop = fixture.stop || fixture.writes.size() == 2; };
  fixture.wait(1s);
  fixture.before_action = [] {};
  fixture.restart();
  fixture.link_up();
  fixture.wait(2s);
  EXPECT_EQ(fixture.writes.back(), "RESPONSE_STATE=902");
  EXPECT_THAT(fixture.journal_state.open_calls(), IsEmpty());
}

TEST_F(ChannelDeadline, IsMeasuredFromTheRequestAlsoAfterARestart) {
  fixture.policy.deadline = Rule{10s, 902};
  fixture.dispatched_call();
  fixture.wait(8s);
  fixture.restart();
  fixture.link_up();
  fixture.wait(3s);
  expect_answer("millrace: no response within 10 s", 902);
}

TEST_F(ChannelDeadline, WithALostAtMostOnceCallEndsWithTheConfiguredState) {
  fixture.policy.lost = Rule{2s, 903};
  fixture.blocked_call();
  fixture.wait(1s);
  EXPECT_THAT(fixture.writes, IsEmpty());
  fixture.wait(2s);
  expect_answer("millrace: its instance is lost, and the call must not run twice", 903);
}

TEST_F(ChannelDeadline, WithALostCallIsForgottenWhenItsInstanceComesBack) {
  fixture.policy.lost = Rule{2s, 903};
  fixture.blocked_call();
  fixture.assign();
  fixture.wait(1min);
  EXPECT_THAT(fixture.writes, IsEmpty());
}

TEST_F(ChannelDeadline, IsNotNeededWhenAnOperatorAnswers) {
  fixture.blocked_call();
  fixture.answer("go on", 7, "ann@hmi");
  expect_answer("go on", 7);
  fixture.receive(fixture.reply("1.414", 1));
  EXPECT_EQ(sut().status().late, 1U);
}

TEST_F(ChannelDeadline, AcceptsTheFirstOfTwoAnswers) {
  fixture.dispatched_call();
  fixture.journal_works = false;
  fixture.receive(fixture.reply("1.414", 1));
  fixture.answer("go on", 7, "ann@hmi");
  EXPECT_EQ(sut().call()->answer->text, "1.414");
}

TEST_F(ChannelDeadline, AllowsAnotherAttemptWhenAnOperatorRetries) {
  fixture.blocked_call();
  fixture.retry("ann@hmi");
  EXPECT_EQ(sut().status().state, fabric::ChannelState::waiting);
  EXPECT_EQ(sut().status().reason, "dispatched again by ann@hmi");
  fixture.assign(2, 2);
  EXPECT_EQ(fixture.published.back().attempt, 2U);
}

TEST(Policies, PreferTheClosestScope) {
  Policies sut;
  sut.everywhere = {.unserved = Rule{1s, 1}, .deadline = Rule{1s, 2}};
  sut.by_machine["press"] = {.deadline = Rule{2s, 3}};
  sut.by_uuid["uuid"] = {.deadline = Rule{3s, 4}};
  EXPECT_EQ(sut.of("press", "uuid"), (Policy{.unserved = Rule{1s, 1}, .deadline = Rule{3s, 4}}));
  EXPECT_EQ(sut.of("press", "other"), (Policy{.unserved = Rule{1s, 1}, .deadline = Rule{2s, 3}}));
  EXPECT_EQ(sut.of("cnc", "other"), sut.everywhere);
}

// How a channel is read while its controller sends notifications.

class NotifiedChannel : public testing::Test {
 protected:
  void start_notifications() {
    fixture.link_up();
    fixture.wait(1s);
    sut().set_notified(true, fixture.now);
    fixture.settle();
    // For earlier timers.
    fixture.wait(500ms);
    fixture.reads = 0;
  }
  void change(Variable variable = Variable::request_state) {
    sut().on_change(variable, fixture.now);
    fixture.settle();
  }
  channel::Channel& sut() { return *fixture.sut; }
  ChannelFixture fixture;
};

TEST_F(NotifiedChannel, IsReadTwiceASecond) {
  start_notifications();
  fixture.wait(10s);
  EXPECT_EQ(fixture.reads, 20U);
}

TEST_F(NotifiedChannel, IsReadAtOnceWhenSomethingHasChanged) {
  start_notifications();
  fixture.call();
  change();
  EXPECT_EQ(fixture.offers, 1U);
  EXPECT_EQ(fixture.reads, 2U) << "the request, and the same once more";
}

TEST_F(NotifiedChannel, IsAcceptedByTheUsualRules) {
  start_notifications();
  fixture.call("old", 1);
  int actions = 0;
  fixture.before_action = [&] {
    if (++actions == 2) {
      fixture.call("new", 2);
    }
  };
  change();
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->request.text, "new");
  EXPECT_EQ(fixture.reads, 3U) << "after a difference there is another read";
}

TEST_F(NotifiedChannel, IsFoundWithoutANotificationAtTheNextSafetyRead) {
  start_notifications();
  fixture.call();
  fixture.wait(500ms);
  EXPECT_EQ(fixture.offers, 1U);
}

TEST_F(NotifiedChannel, IsReadOnceMoreWhenItChangesDuringARead) {
  start_notifications();
  bool first = true;
  fixture.before_action = [&] {
    if (std::exchange(first, false)) {
      // The read has been sent; the program writes after it.
      static_cast<void>(sut().on_change(Variable::request_state, fixture.now));
    }
  };
  change();
  EXPECT_EQ(fixture.reads, 2U);
}

TEST_F(NotifiedChannel, IsPolledAgainAtOnceWithoutNotifications) {
  start_notifications();
  sut().set_notified(false, fixture.now);
  fixture.settle();
  fixture.call();
  fixture.wait(11ms);
  EXPECT_EQ(fixture.offers, 1U);
}

TEST_F(NotifiedChannel, IsPolledOnANewLinkUntilNotificationsReturn) {
  start_notifications();
  fixture.link_down("cable");
  fixture.link_up();
  fixture.wait(1s);
  EXPECT_GE(fixture.reads, 100U);
}

TEST_F(NotifiedChannel, DetectsAtOnceThatAProgramHasWithdrawnItsCall) {
  start_notifications();
  fixture.call();
  change();
  fixture.assign();
  fixture.reads = 0;
  fixture.wait(400ms);
  EXPECT_LE(fixture.reads, 1U) << "a call that runs is not polled";
  fixture.channel.set_request_state(0);
  change();
  EXPECT_EQ(sut().call(), nullptr);
  EXPECT_THAT(fixture.withdrawn, ElementsAre(instance(1)));
}

TEST_F(NotifiedChannel, ResponseStateIsOfInterestAfterAnInterimAnswerOnly) {
  start_notifications();
  change(Variable::response_state);
  EXPECT_EQ(fixture.reads, 0U);
  fixture.call();
  change();
  fixture.assign();
  fixture.reads = 0;
  change(Variable::response_state);
  EXPECT_EQ(fixture.reads, 0U);
  fixture.receive(fixture.interim("half", 5));
  fixture.reads = 0;
  change(Variable::response_state);
  EXPECT_EQ(fixture.reads, 1U);
}

}  // namespace
}  // namespace millrace::gateway
