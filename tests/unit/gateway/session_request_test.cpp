// How a channel session finds requests and gives them out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/gateway/desk.hpp"

namespace millrace::gateway {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using enum fabric::EventKind;
using namespace std::chrono_literals;

class ChannelRequest : public testing::Test {
 protected:
  channel::ChannelSession& sut() { return *desk.sut; }
  Desk desk;
};

TEST_F(ChannelRequest, IsOfferedOnceItsStateIsTheSameAfterItsTextsWereRead) {
  desk.link_up();
  desk.call("2", 7);
  desk.wait(20ms);
  EXPECT_EQ(desk.offers, 1U);
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->request, (PendingRequest{square_root_uuid, "2", 7}));
  EXPECT_EQ(sut().status().state, fabric::ChannelState::waiting);
  EXPECT_THAT(desk.event_kinds(), ElementsAre(seen));
}

TEST_F(ChannelRequest, IsReadAgainWhenItsStateMovesMeanwhile) {
  desk.link_up();
  desk.call("old", 1);
  int actions = 0;
  desk.before_action = [&] {
    // 1 finds the state, 2 reads the texts; before 3 the program changes everything.
    if (++actions == 3) {
      desk.call("new", 2);
    }
  };
  desk.wait(20ms);
  EXPECT_EQ(desk.offers, 1U);
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->request.text, "new");
}

// Each alone: where two of them changed, one that was not compared went unnoticed.
TEST_F(ChannelRequest, IsReadAgainWhenOnlyOneOfItsThreePartsChangesMeanwhile) {
  const std::string other = "11111111-2222-3333-4444-555555555555";
  for (const PendingRequest& later :
       {PendingRequest{other, "2", 1}, {square_root_uuid, "3", 1}, {square_root_uuid, "2", 4}}) {
    renew(desk);
    desk.link_up();
    desk.call("2", 1);
    int actions = 0;
    desk.before_action = [&] {
      if (++actions == 3) {
        desk.channel.call(later);
      }
    };
    desk.wait(20ms);
    EXPECT_EQ(desk.offers, 1U);
    ASSERT_NE(sut().call(), nullptr);
    EXPECT_EQ(sut().call()->request, later);
  }
}

TEST_F(ChannelRequest, IsNotOfferedWhenTheProgramTakesItBackMeanwhile) {
  desk.link_up();
  desk.call();
  int actions = 0;
  desk.before_action = [&] {
    if (++actions == 3) {
      desk.channel.set_request_state(0);
    }
  };
  desk.wait(20ms);
  EXPECT_EQ(desk.offers, 0U);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::idle);
}

TEST_F(ChannelRequest, OfAForeignUuidLeavesTheChannelUntouchedAndIsReportedOnce) {
  desk.served = false;
  desk.link_up();
  desk.call();
  desk.wait(10s);
  EXPECT_THAT(desk.writes, IsEmpty());
  EXPECT_THAT(desk.event_kinds(), ElementsAre(unserved));
  EXPECT_EQ(desk.events.front().detail, "served by nobody");
  EXPECT_EQ(sut().status().state, fabric::ChannelState::unserved);
  EXPECT_EQ(sut().status().reason, "served by nobody");
  EXPECT_EQ(sut().status().uuid, square_root_uuid);
}

// Other gateways take idle for the end of the calls that they have heard of. Found by the
// simulation.
TEST_F(ChannelRequest, OfAChannelThatHasNotBeenLookedAtIsNotCalledIdle) {
  sut().on_link_up(desk.now);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::link_down);
  sut().on_read({ReadSet::state, "", "", 0, 0, ""}, desk.now);
  desk.settle();
  EXPECT_EQ(sut().status().state, fabric::ChannelState::idle);
}

// Another gateway takes over a channel that is idle.
TEST_F(ChannelRequest, OfAChannelThatWasIdleBeforeItsLinkBrokeIsLookedForBeforeItIsCalledIdle) {
  desk.link_up();
  desk.wait(20ms);
  ASSERT_EQ(sut().status().state, fabric::ChannelState::idle);
  sut().on_link_down("cable", desk.now);
  desk.settle();
  static_cast<void>(sut().on_link_up(desk.now));
  EXPECT_NE(sut().status().state, fabric::ChannelState::idle);
}

TEST_F(ChannelRequest, OfAForeignUuidIsForgottenWhenItGoes) {
  desk.served = false;
  desk.link_up();
  desk.call();
  desk.wait(20ms);
  desk.channel.set_request_state(0);
  desk.wait(20ms);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::idle);
  EXPECT_EQ(sut().status().reason, "");
  desk.call();
  desk.wait(20ms);
  EXPECT_THAT(desk.event_kinds(), ElementsAre(unserved, unserved));
}

TEST_F(ChannelRequest, ThatWasLeftIsTakenWhenAnInstanceAppears) {
  desk.served = false;
  desk.link_up();
  desk.call();
  desk.wait(20ms);
  desk.served = true;
  sut().reconsider(desk.now);
  desk.settle();
  EXPECT_NE(sut().call(), nullptr);
}

TEST_F(ChannelRequest, ThatIsLeftAgainForTheSameReasonIsNotReportedAgain) {
  desk.served = false;
  desk.link_up();
  desk.call();
  desk.wait(20ms);
  sut().reconsider(desk.now);
  desk.settle();
  desk.wait(20ms);
  EXPECT_EQ(desk.offers, 2U);
  EXPECT_THAT(desk.event_kinds(), ElementsAre(unserved));
}

TEST_F(ChannelRequest, WithNewTextsUnderTheSameStateIsNoticedWithinHalfASecond) {
  desk.served = false;
  desk.link_up();
  desk.call("first");
  desk.wait(20ms);
  desk.served = true;
  desk.call("second");
  desk.wait(600ms);
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->request.text, "second");
}

TEST_F(ChannelRequest, UnderWayThatGetsNewTextsUnderTheSameStateIsOverWithinHalfASecond) {
  desk.dispatched_call();
  desk.channel.set_request("3");
  desk.wait(520ms);
  EXPECT_THAT(desk.withdrawn, ElementsAre(instance(1)));
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->request.text, "3");
}

TEST_F(ChannelRequest, IsJournaledBeforeItIsPublished) {
  desk.journal_works = false;
  desk.dispatched_call();
  EXPECT_THAT(desk.published, IsEmpty());
  ASSERT_EQ(desk.unconfirmed.size(), 1U);
  sut().on_recorded(desk.unconfirmed.front().ticket.number, desk.now);
  desk.settle();
  ASSERT_EQ(desk.published.size(), 1U);
  EXPECT_EQ(desk.published.front().assigned, instance(1));
  EXPECT_EQ(desk.published.front().attempt, 1U);
  EXPECT_EQ(desk.published.front().text, "2");
  EXPECT_THAT(desk.event_kinds(), ElementsAre(seen, dispatched));
}

TEST_F(ChannelRequest, OfALostInstanceGoesToTheNextUnderTheSameIdAndAHigherAttempt) {
  desk.dispatched_call();
  sut().suspend("instance 1 is lost", false, desk.now);
  desk.settle();
  EXPECT_EQ(sut().status().state, fabric::ChannelState::waiting);
  EXPECT_EQ(sut().status().reason, "instance 1 is lost");
  sut().assign(desk.assignment(2, 2), desk.now);
  desk.settle();
  ASSERT_EQ(desk.published.size(), 2U);
  EXPECT_EQ(desk.published[1].call, desk.published[0].call);
  EXPECT_EQ(desk.published[1].attempt, 2U);
  EXPECT_EQ(desk.published[1].assigned, instance(2));
  EXPECT_EQ(sut().status().repeated, 1U);
  EXPECT_THAT(desk.event_kinds(), ElementsAre(seen, dispatched, lost, dispatched));
}

TEST_F(ChannelRequest, IsPublishedAgainUnchangedToAnInstanceThatCameBack) {
  desk.dispatched_call();
  sut().assign(desk.assignment(1, 1), desk.now);
  desk.settle();
  ASSERT_EQ(desk.published.size(), 2U);
  EXPECT_EQ(desk.published[1].attempt, 1U);
  EXPECT_EQ(sut().status().repeated, 0U);
  EXPECT_EQ(desk.ledger.open_calls().front().attempts.size(), 1U);
}

TEST_F(ChannelRequest, IsNotPublishedIfItsInstanceIsLostBeforeTheJournalHasIt) {
  desk.journal_works = false;
  desk.dispatched_call();
  sut().suspend("lost", false, desk.now);
  desk.settle();
  sut().on_recorded(desk.unconfirmed.front().ticket.number, desk.now);
  desk.settle();
  EXPECT_THAT(desk.published, IsEmpty());
}

TEST_F(ChannelRequest, HeldForAnOperatorSaysSo) {
  desk.delivery = fabric::Delivery::at_most_once;
  desk.dispatched_call();
  sut().suspend("it must not run twice", true, desk.now);
  desk.settle();
  EXPECT_EQ(sut().status().state, fabric::ChannelState::held);
  EXPECT_THAT(desk.event_kinds(), ElementsAre(seen, dispatched, lost, held));
}

TEST_F(ChannelRequest, TakenBackByTheProgramEndsTheCallAtTheService) {
  desk.dispatched_call();
  desk.channel.set_request_state(0);
  desk.wait(20ms);
  EXPECT_EQ(sut().call(), nullptr);
  EXPECT_THAT(desk.withdrawn, ElementsAre(instance(1)));
  EXPECT_THAT(desk.event_kinds(), ElementsAre(seen, dispatched, withdrawn));
  EXPECT_EQ(desk.events.back().detail, "the program took the request back");
  EXPECT_EQ(sut().status().withdrawn, 1U);
  EXPECT_THAT(desk.ledger.open_calls(), IsEmpty());
  EXPECT_THAT(desk.writes, IsEmpty());
}

TEST_F(ChannelRequest, ReplacedByAnotherEndsTheCallAndBeginsANewOne) {
  desk.dispatched_call();
  desk.call("3", 2);
  desk.wait(20ms);
  EXPECT_EQ(desk.offers, 2U);
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->id.number, 2U);
  EXPECT_EQ(sut().call()->request.text, "3");
}

TEST_F(ChannelRequest, AnsweredBySomebodyElseEndsTheCall) {
  desk.dispatched_call();
  desk.channel.write(Variable::request_state, 0U);
  desk.channel.write(Variable::response_state, 1U);
  desk.wait(600ms);
  EXPECT_EQ(sut().call(), nullptr);
  EXPECT_THAT(desk.writes, IsEmpty());
}

TEST_F(ChannelRequest, IsLookedForEveryTenMillisecondsWhileIdle) {
  desk.link_up();
  desk.wait(1s);
  EXPECT_GE(desk.reads, 100U);
  EXPECT_LE(desk.reads, 102U);
}

TEST_F(ChannelRequest, IsNotLookedForWhileTheLinkIsDown) {
  desk.link_up();
  sut().on_link_down("connection refused", desk.now);
  desk.settle();
  const auto reads = desk.reads;
  desk.wait(1s);
  EXPECT_EQ(desk.reads, reads);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::link_down);
  EXPECT_EQ(sut().status().reason, "connection refused");
}

TEST_F(ChannelRequest, SurvivesALinkThatIsDownForAWhile) {
  desk.dispatched_call();
  sut().on_link_down("gone", desk.now);
  desk.settle();
  desk.wait(1s);
  desk.link_up();
  desk.wait(1s);
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::running);
  EXPECT_EQ(desk.published.size(), 1U);
}

TEST_F(ChannelRequest, ThatCannotBeReadIsTriedAgainAndTheReasonShown) {
  desk.unreadable = "0x710 symbol not found";
  desk.link_up();
  EXPECT_EQ(sut().status().reason, "0x710 symbol not found");
  EXPECT_EQ(desk.reads, 0U);
  desk.unreadable.clear();
  desk.wait(600ms);
  EXPECT_GE(desk.reads, 1U);
  EXPECT_EQ(sut().status().reason, "");
}

TEST_F(ChannelRequest, OfAnEarlierRunIsResumedOnceTheChannelStillShowsIt) {
  desk.dispatched_call();
  desk.restart();
  EXPECT_EQ(desk.resumed, 0U);
  desk.link_up();
  EXPECT_EQ(desk.resumed, 1U);
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->id, desk.published.front().call);
}

TEST_F(ChannelRequest, OfAnEarlierRunThatIsGoneIsNotResumed) {
  desk.dispatched_call();
  desk.restart();
  desk.channel.set_request_state(0);
  desk.link_up();
  EXPECT_EQ(desk.resumed, 0U);
  EXPECT_EQ(sut().call(), nullptr);
  EXPECT_THAT(desk.ledger.open_calls(), IsEmpty());
}

// The second request had the state of the first, and its texts were half written. Found by the
// simulation.
TEST(RequestWatch, TakesNoRequestWhoseTextsAreHalfWrittenUnderTheStateOfTheOneBefore) {
  channel::RequestWatch sut;
  EXPECT_FALSE(sut.on_look({ReadSet::state, "", "", 3, 0, ""}));
  EXPECT_FALSE(sut.on_look({ReadSet::texts, "new uuid", "old text", 0, 0, ""}));
  EXPECT_FALSE(sut.on_look({ReadSet::request, "new uuid", "new text", 3, 0, ""}));
  const auto request = sut.on_look({ReadSet::request, "new uuid", "new text", 3, 0, ""});
  EXPECT_EQ(request, (PendingRequest{"new uuid", "new text", 3}));
}

// It waited for an instance for ever, whatever the policy said. Found by the simulation.
TEST(RestartedGateway, LooksAnewAtACallThatItWasAboutToAnswerItself) {
  Desk desk;
  desk.ledger.apply(DispatchedEntry{{0x5f3a, 1},
                                    {"cnc", 1},
                                    {square_root_uuid, "2", 1},
                                    {},
                                    fabric::Delivery::at_least_once,
                                    0,
                                    {}});
  desk.call();
  desk.restart();
  desk.served = false;
  desk.link_up();
  desk.wait(std::chrono::milliseconds(50));
  EXPECT_EQ(desk.sut->call(), nullptr);
  EXPECT_EQ(desk.resumed, 0U);
  EXPECT_GE(desk.offers, 1U);
  EXPECT_TRUE(desk.ledger.open_calls().empty());
}

}  // namespace
}  // namespace millrace::gateway
