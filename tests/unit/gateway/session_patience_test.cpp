// What a program gets when no service answers it: the configured rules, and the operator.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/gateway/desk.hpp"

namespace millrace::gateway {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using enum fabric::EventKind;
using namespace std::chrono_literals;

class Patience : public testing::Test {
 protected:
  channel::ChannelSession& sut() { return *desk.sut; }
  void expect_answer(const std::string& text, std::uint32_t state) {
    EXPECT_THAT(desk.writes, ElementsAre("RESPONSE=" + text, "REQUEST_STATE=0",
                                         fmt::format("RESPONSE_STATE={}", state)));
    EXPECT_EQ(sut().call(), nullptr);
    EXPECT_THAT(desk.ledger.open_calls(), IsEmpty());
  }
  Desk desk;
};

TEST_F(Patience, IsEndlessByDefault) {
  desk.dispatched_call();
  desk.wait(1h);
  EXPECT_THAT(desk.writes, IsEmpty());
  EXPECT_NE(sut().call(), nullptr);
}

TEST_F(Patience, WithAnUnservedRequestEndsWithAnOfferThatSaysSo) {
  desk.policy.unserved = Rule{5s, 901};
  desk.served = false;
  desk.link_up();
  desk.call();
  desk.wait(4s);
  EXPECT_EQ(desk.offers, 1U);
  desk.wait(2s);
  EXPECT_EQ(desk.offers, 2U);
  EXPECT_TRUE(desk.out_of_patience);
  desk.wait(1min);
  EXPECT_EQ(desk.offers, 2U) << "it is offered once more, not again and again";
}

TEST_F(Patience, WithAnUnservedRequestBeginsAnewWithTheNextOne) {
  desk.policy.unserved = Rule{5s, 901};
  desk.served = false;
  desk.link_up();
  desk.call("first");
  desk.wait(4s);
  desk.call("second", 2);
  desk.wait(4s);
  EXPECT_FALSE(desk.out_of_patience);
}

TEST_F(Patience, EndsAtTheDeadlineWithTheConfiguredState) {
  desk.policy.deadline = Rule{30s, 902};
  desk.dispatched_call();
  EXPECT_EQ(desk.published.front().deadline, desk.published.front().seen + 30s);
  desk.wait(29s);
  EXPECT_THAT(desk.writes, IsEmpty());
  desk.wait(2s);
  expect_answer("millrace: no answer within 30 s", 902);
  EXPECT_THAT(desk.withdrawn, ElementsAre(instance(1)));
  EXPECT_THAT(desk.event_kinds(), ElementsAre(seen, dispatched, replied, written));
  EXPECT_EQ(desk.events[2].detail, "answered by the gateway");
}

TEST_F(Patience, IsReportedOverAtADeadlineWithoutAState) {
  desk.policy.deadline = Rule{1500ms, 0};
  desk.dispatched_call();
  desk.wait(10s);
  EXPECT_THAT(desk.writes, IsEmpty());
  EXPECT_EQ(sut().status().reason, "no answer within 1.5 s; the program waits on");
  EXPECT_THAT(desk.event_kinds(), ElementsAre(seen, dispatched, late));
}

TEST_F(Patience, WithACallNobodyWasAskedIsJournaledToo) {
  desk.policy.deadline = Rule{1s, 902};
  desk.link_up();
  desk.call();
  desk.wait(900ms);
  desk.before_action = [&] { desk.stop = desk.stop || desk.writes.size() == 2; };
  desk.wait(1s);
  desk.before_action = [] {};
  desk.restart();
  desk.link_up();
  desk.wait(2s);
  EXPECT_EQ(desk.writes.back(), "RESPONSE_STATE=902");
  EXPECT_THAT(desk.ledger.open_calls(), IsEmpty());
}

TEST_F(Patience, IsMeasuredFromTheRequestAlsoAfterARestart) {
  desk.policy.deadline = Rule{10s, 902};
  desk.dispatched_call();
  desk.wait(8s);
  desk.restart();
  desk.link_up();
  desk.wait(3s);
  expect_answer("millrace: no answer within 10 s", 902);
}

TEST_F(Patience, WithALostAtMostOnceCallEndsWithTheConfiguredState) {
  desk.policy.lost = Rule{2s, 903};
  desk.delivery = fabric::Delivery::at_most_once;
  desk.dispatched_call();
  sut().suspend("lost", true, desk.now);
  desk.settle();
  desk.wait(1s);
  EXPECT_THAT(desk.writes, IsEmpty());
  desk.wait(2s);
  expect_answer("millrace: its instance is lost, and it must not run twice", 903);
}

// It was said at each look. Found by the simulation.
TEST_F(Patience, WithALostCallIsSaidOnceWhereNoStateIsConfigured) {
  desk.policy.lost = Rule{2s, 0};
  desk.delivery = fabric::Delivery::at_most_once;
  desk.dispatched_call();
  sut().suspend("lost", true, desk.now);
  desk.settle();
  desk.wait(1min);
  EXPECT_EQ(std::ranges::count(desk.events, late, &fabric::Event::kind), 1);
}

TEST_F(Patience, WithALostCallIsForgottenWhenItsInstanceComesBack) {
  desk.policy.lost = Rule{2s, 903};
  desk.delivery = fabric::Delivery::at_most_once;
  desk.dispatched_call();
  sut().suspend("lost", true, desk.now);
  desk.settle();
  sut().assign(desk.assignment(), desk.now);
  desk.settle();
  desk.wait(1min);
  EXPECT_THAT(desk.writes, IsEmpty());
}

TEST_F(Patience, IsNotNeededByAnOperatorWhoAnswers) {
  desk.delivery = fabric::Delivery::at_most_once;
  desk.dispatched_call();
  sut().suspend("lost", true, desk.now);
  desk.settle();
  sut().settle({response("go on", 7), "ann@hmi"}, desk.now);
  desk.settle();
  expect_answer("go on", 7);
  sut().on_reply(desk.reply("1.414", 1), desk.now);
  desk.settle();
  EXPECT_EQ(sut().status().late, 1U);
}

TEST_F(Patience, LetsTheFirstOfTwoAnswersWin) {
  desk.dispatched_call();
  desk.journal_works = false;
  sut().on_reply(desk.reply("1.414", 1), desk.now);
  desk.settle();
  sut().settle({response("go on", 7), "ann@hmi"}, desk.now);
  desk.settle();
  EXPECT_EQ(sut().call()->answer->text, "1.414");
}

TEST_F(Patience, IsGivenAnotherChanceByAnOperatorWhoRetries) {
  desk.delivery = fabric::Delivery::at_most_once;
  desk.dispatched_call();
  sut().suspend("lost", true, desk.now);
  desk.settle();
  sut().retry("ann@hmi", desk.now);
  desk.settle();
  EXPECT_EQ(sut().status().state, fabric::ChannelState::waiting);
  EXPECT_EQ(sut().status().reason, "given out again by ann@hmi");
  sut().assign(desk.assignment(2, 2), desk.now);
  desk.settle();
  EXPECT_EQ(desk.published.back().attempt, 2U);
}

TEST(Policies, LetTheClosestSayMost) {
  Policies sut;
  sut.everywhere = {.unserved = Rule{1s, 1}, .deadline = Rule{1s, 2}};
  sut.by_machine["press"] = {.deadline = Rule{2s, 3}};
  sut.by_uuid["uuid"] = {.deadline = Rule{3s, 4}};
  EXPECT_EQ(sut.of("press", "uuid"), (Policy{.unserved = Rule{1s, 1}, .deadline = Rule{3s, 4}}));
  EXPECT_EQ(sut.of("press", "other"), (Policy{.unserved = Rule{1s, 1}, .deadline = Rule{2s, 3}}));
  EXPECT_EQ(sut.of("cnc", "other"), sut.everywhere);
}

}  // namespace
}  // namespace millrace::gateway
