// How a channel finds requests and dispatches them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/messages/catalogue.hpp"
#include "tests/unit/gateway/channel_fixture.hpp"

namespace millrace::gateway {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using enum fabric::EventKind;
using namespace std::chrono_literals;

class ChannelRequest : public testing::Test {
 protected:
  channel::Channel& sut() { return *fixture.sut; }
  ChannelFixture fixture;
};

TEST_F(ChannelRequest, IsOfferedOnceItsStateIsTheSameAfterItsTextsWereRead) {
  fixture.link_up();
  fixture.call("2", 7);
  fixture.wait(20ms);
  EXPECT_EQ(fixture.offers, 1U);
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->request, (PendingRequest{square_root_uuid, "2", 7}));
  EXPECT_EQ(sut().status().state, fabric::ChannelState::waiting);
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(seen));
}

TEST_F(ChannelRequest, IsReadAgainWhenItsStateChangesInBetween) {
  fixture.link_up();
  fixture.call("old", 1);
  int actions = 0;
  fixture.before_action = [&] {
    // 1 finds the state, 2 reads the texts; before 3 the program changes everything.
    if (++actions == 3) {
      fixture.call("new", 2);
    }
  };
  fixture.wait(20ms);
  EXPECT_EQ(fixture.offers, 1U);
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->request.text, "new");
}

// Each variable alone: a regression, where one of two changes was not detected.
TEST_F(ChannelRequest, IsReadAgainWhenOnlyOneOfItsThreePartsChangesInBetween) {
  const std::string other = "11111111-2222-3333-4444-555555555555";
  for (const PendingRequest& later :
       {PendingRequest{other, "2", 1}, {square_root_uuid, "3", 1}, {square_root_uuid, "2", 4}}) {
    renew(fixture);
    fixture.link_up();
    fixture.call("2", 1);
    int actions = 0;
    fixture.before_action = [&] {
      if (++actions == 3) {
        fixture.channel.call(later);
      }
    };
    fixture.wait(20ms);
    EXPECT_EQ(fixture.offers, 1U);
    ASSERT_NE(sut().call(), nullptr);
    EXPECT_EQ(sut().call()->request, later);
  }
}

TEST_F(ChannelRequest, IsNotOfferedWhenTheProgramWithdrawsItInBetween) {
  fixture.link_up();
  fixture.call();
  int actions = 0;
  fixture.before_action = [&] {
    if (++actions == 3) {
      fixture.channel.set_request_state(0);
    }
  };
  fixture.wait(20ms);
  EXPECT_EQ(fixture.offers, 0U);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::idle);
}

TEST_F(ChannelRequest, OfAForeignUuidLeavesTheChannelUntouchedAndIsReportedOnce) {
  fixture.served = false;
  fixture.link_up();
  fixture.call();
  fixture.wait(10s);
  EXPECT_THAT(fixture.writes, IsEmpty());
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(unserved));
  EXPECT_EQ(fixture.events.front().detail, "no service has this UUID");
  EXPECT_EQ(sut().status().state, fabric::ChannelState::unserved);
  EXPECT_EQ(sut().status().reason, "no service has this UUID");
  EXPECT_EQ(sut().status().uuid, square_root_uuid);
}

// For other gateways, an idle status ends the calls that they know. Found by the simulation.
TEST_F(ChannelRequest, OfAnUnreadChannelIsNotReportedIdle) {
  sut().on_link_up(fixture.now);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::link_down);
  sut().on_read({ReadSet::state, "", "", 0, 0, ""}, fixture.now);
  fixture.settle();
  EXPECT_EQ(sut().status().state, fabric::ChannelState::idle);
}

// Another gateway takes over a channel that is idle.
TEST_F(ChannelRequest, OfAChannelThatWasIdleBeforeItsLinkBrokeIsReadBeforeItIsReportedIdle) {
  fixture.link_up();
  fixture.wait(20ms);
  ASSERT_EQ(sut().status().state, fabric::ChannelState::idle);
  fixture.link_down("cable");
  static_cast<void>(sut().on_link_up(fixture.now));
  EXPECT_NE(sut().status().state, fabric::ChannelState::idle);
}

TEST_F(ChannelRequest, OfAForeignUuidIsForgottenWhenItGoes) {
  fixture.served = false;
  fixture.link_up();
  fixture.call();
  fixture.wait(20ms);
  fixture.channel.set_request_state(0);
  fixture.wait(20ms);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::idle);
  EXPECT_EQ(sut().status().reason, "");
  fixture.call();
  fixture.wait(20ms);
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(unserved, unserved));
}

TEST_F(ChannelRequest, ThatIsLeftAgainForTheSameReasonIsNotReportedAgain) {
  fixture.served = false;
  fixture.link_up();
  fixture.call();
  fixture.wait(20ms);
  sut().offer_again(fixture.now);
  fixture.settle();
  fixture.wait(20ms);
  EXPECT_EQ(fixture.offers, 2U);
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(unserved));
}

TEST_F(ChannelRequest, WithNewTextsUnderTheSameStateIsNoticedWithinHalfASecond) {
  fixture.served = false;
  fixture.link_up();
  fixture.call("first");
  fixture.wait(20ms);
  fixture.served = true;
  fixture.call("second");
  fixture.wait(600ms);
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->request.text, "second");
}

TEST_F(ChannelRequest, UnderWayThatGetsNewTextsUnderTheSameStateIsOverWithinHalfASecond) {
  fixture.dispatched_call();
  fixture.channel.set_request("3");
  fixture.wait(520ms);
  EXPECT_THAT(fixture.withdrawn, ElementsAre(instance(1)));
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->request.text, "3");
}

TEST_F(ChannelRequest, IsJournaledBeforeItIsPublished) {
  fixture.journal_works = false;
  fixture.dispatched_call();
  EXPECT_THAT(fixture.published, IsEmpty());
  ASSERT_EQ(fixture.unconfirmed.size(), 1U);
  fixture.confirm();
  ASSERT_EQ(fixture.published.size(), 1U);
  EXPECT_EQ(fixture.published.front().assigned, instance(1));
  EXPECT_EQ(fixture.published.front().attempt, 1U);
  EXPECT_EQ(fixture.published.front().text, "2");
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(seen, dispatched));
}

TEST_F(ChannelRequest, OfALostInstanceGoesToTheNextUnderTheSameIdAndAHigherAttempt) {
  fixture.dispatched_call();
  fixture.suspend(base::messages::instance_lost("instance 1"), false);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::waiting);
  EXPECT_EQ(sut().status().reason.code, "instance_lost");
  EXPECT_EQ(sut().status().reason, base::messages::instance_lost("instance 1"));
  fixture.assign(2, 2);
  ASSERT_EQ(fixture.published.size(), 2U);
  EXPECT_EQ(fixture.published[1].call, fixture.published[0].call);
  EXPECT_EQ(fixture.published[1].attempt, 2U);
  EXPECT_EQ(fixture.published[1].assigned, instance(2));
  EXPECT_EQ(sut().status().repeated, 1U);
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(seen, dispatched, lost, dispatched));
}

TEST_F(ChannelRequest, IsPublishedAgainUnchangedToAnInstanceThatCameBack) {
  fixture.dispatched_call();
  fixture.assign(1, 1);
  ASSERT_EQ(fixture.published.size(), 2U);
  EXPECT_EQ(fixture.published[1].attempt, 1U);
  EXPECT_EQ(sut().status().repeated, 0U);
  EXPECT_EQ(fixture.journal_state.open_calls().front().attempts.size(), 1U);
}

TEST_F(ChannelRequest, IsNotPublishedIfItsInstanceIsLostBeforeTheJournalHasIt) {
  fixture.journal_works = false;
  fixture.dispatched_call();
  fixture.suspend("lost", false);
  fixture.confirm();
  EXPECT_THAT(fixture.published, IsEmpty());
}

TEST_F(ChannelRequest, BlockedForAnOperatorIsReported) {
  fixture.delivery = fabric::Delivery::at_most_once;
  fixture.dispatched_call();
  fixture.suspend("it must not run twice", true);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::held);
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(seen, dispatched, lost, held));
}

TEST_F(ChannelRequest, WithdrawnByTheProgramEndsTheCallAtTheService) {
  fixture.dispatched_call();
  fixture.channel.set_request_state(0);
  fixture.wait(20ms);
  EXPECT_EQ(sut().call(), nullptr);
  EXPECT_THAT(fixture.withdrawn, ElementsAre(instance(1)));
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(seen, dispatched, withdrawn));
  EXPECT_EQ(fixture.events.back().detail, "the NC program withdrew the request");
  EXPECT_EQ(sut().status().withdrawn, 1U);
  EXPECT_THAT(fixture.journal_state.open_calls(), IsEmpty());
  EXPECT_THAT(fixture.writes, IsEmpty());
}

TEST_F(ChannelRequest, ReplacedByAnotherEndsTheCallAndBeginsANewOne) {
  fixture.dispatched_call();
  fixture.call("3", 2);
  fixture.wait(20ms);
  EXPECT_EQ(fixture.offers, 2U);
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->id.number, 2U);
  EXPECT_EQ(sut().call()->request.text, "3");
}

TEST_F(ChannelRequest, AnsweredByAnotherClientEndsTheCall) {
  fixture.dispatched_call();
  fixture.channel.write(Variable::request_state, 0U);
  fixture.channel.write(Variable::response_state, 1U);
  fixture.wait(600ms);
  EXPECT_EQ(sut().call(), nullptr);
  EXPECT_THAT(fixture.writes, IsEmpty());
}

TEST_F(ChannelRequest, IsPolledEveryTenMillisecondsWhileIdle) {
  fixture.link_up();
  fixture.wait(1s);
  EXPECT_GE(fixture.reads, 100U);
  EXPECT_LE(fixture.reads, 102U);
}

TEST_F(ChannelRequest, IsNotPolledWhileTheLinkIsDown) {
  fixture.link_up();
  fixture.link_down("connection refused");
  const auto reads = fixture.reads;
  fixture.wait(1s);
  EXPECT_EQ(fixture.reads, reads);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::link_down);
  EXPECT_EQ(sut().status().reason, "connection refused");
}

TEST_F(ChannelRequest, SurvivesALinkThatIsDownForAWhile) {
  fixture.dispatched_call();
  fixture.link_down("gone");
  fixture.wait(1s);
  fixture.link_up();
  fixture.wait(1s);
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::running);
  EXPECT_EQ(fixture.published.size(), 1U);
}

TEST_F(ChannelRequest, ThatCannotBeReadIsTriedAgainAndTheReasonShown) {
  fixture.unreadable = "0x710 symbol not found";
  fixture.link_up();
  EXPECT_EQ(sut().status().reason, "0x710 symbol not found");
  EXPECT_EQ(fixture.reads, 0U);
  fixture.unreadable.clear();
  fixture.wait(600ms);
  EXPECT_GE(fixture.reads, 1U);
  EXPECT_EQ(sut().status().reason, "");
}

TEST_F(ChannelRequest, OfAnEarlierRunIsResumedOnceTheChannelStillShowsIt) {
  fixture.dispatched_call();
  fixture.restart();
  EXPECT_EQ(fixture.resumed, 0U);
  fixture.link_up();
  EXPECT_EQ(fixture.resumed, 1U);
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->id, fixture.published.front().call);
}

TEST_F(ChannelRequest, OfAnEarlierRunThatIsGoneIsNotResumed) {
  fixture.dispatched_call();
  fixture.restart();
  fixture.channel.set_request_state(0);
  fixture.link_up();
  EXPECT_EQ(fixture.resumed, 0U);
  EXPECT_EQ(sut().call(), nullptr);
  EXPECT_THAT(fixture.journal_state.open_calls(), IsEmpty());
}

// A regression: the second request had the state of the first, and half-written texts. Found by the
// simulation.
TEST(RequestReader, AcceptsNoHalfWrittenTextsUnderTheStateOfTheRequestBefore) {
  channel::RequestReader sut;
  EXPECT_FALSE(sut.on_read({ReadSet::state, "", "", 3, 0, ""}));
  EXPECT_FALSE(sut.on_read({ReadSet::texts, "new uuid", "old text", 0, 0, ""}));
  EXPECT_FALSE(sut.on_read({ReadSet::request, "new uuid", "new text", 3, 0, ""}));
  const auto request = sut.on_read({ReadSet::request, "new uuid", "new text", 3, 0, ""});
  EXPECT_EQ(request, (PendingRequest{"new uuid", "new text", 3}));
}

// A regression: it waited for an instance for ever, whatever the policy. Found by the simulation.
TEST(RestartedGateway, ReadsACallAgainThatItWasAboutToAnswerItself) {
  ChannelFixture fixture;
  fixture.journal_state.apply(DispatchedEntry{{0x5f3a, 1},
                                              {"cnc", 1},
                                              {square_root_uuid, "2", 1},
                                              {},
                                              fabric::Delivery::at_least_once,
                                              0,
                                              {}});
  fixture.call();
  fixture.restart();
  fixture.served = false;
  fixture.link_up();
  fixture.wait(std::chrono::milliseconds(50));
  EXPECT_EQ(fixture.sut->call(), nullptr);
  EXPECT_EQ(fixture.resumed, 0U);
  EXPECT_GE(fixture.offers, 1U);
  EXPECT_TRUE(fixture.journal_state.open_calls().empty());
}

}  // namespace
}  // namespace millrace::gateway
