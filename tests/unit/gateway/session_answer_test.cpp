// How a channel session brings answers back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/gateway/desk.hpp"

namespace millrace::gateway {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using enum fabric::EventKind;
using namespace std::chrono_literals;

class ChannelAnswer : public testing::Test {
 protected:
  channel::ChannelSession& sut() { return *desk.sut; }
  void reply(const fabric::Reply& reply) {
    sut().on_reply(reply, desk.now);
    desk.settle();
  }
  Desk desk;
};

TEST_F(ChannelAnswer, IsWrittenAsResponseThenRequestStateThenResponseState) {
  desk.dispatched_call();
  reply(desk.reply("1.414", 1));
  EXPECT_THAT(desk.writes, ElementsAre("RESPONSE=1.414", "REQUEST_STATE=0", "RESPONSE_STATE=1"));
  EXPECT_EQ(sut().call(), nullptr);
  EXPECT_EQ(sut().status().answered, 1U);
  EXPECT_THAT(desk.event_kinds(), ElementsAre(seen, dispatched, replied, written));
  EXPECT_THAT(desk.ledger.open_calls(), IsEmpty());
}

// A dispatched call was seen 10 ms ago.
TEST_F(ChannelAnswer, IsLoggedWithTheTimeItTookHoweverTheWallClockIsSet) {
  desk.dispatched_call();
  desk.wait(50ms);
  desk.now.wall -= 8h;
  reply(desk.reply("1.414", 1));
  EXPECT_THAT(desk.said.back(), EndsWith("answered with state 1 after 60.0 ms"));
}

TEST_F(ChannelAnswer, OfAResumedCallIsLoggedWithItsAge) {
  desk.dispatched_call();
  desk.restart();
  desk.wait(1s);
  desk.link_up();
  desk.wait(0ms);
  reply(desk.reply("1.414", 1));
  EXPECT_THAT(desk.said.back(), EndsWith("answered with state 1 after 1010.0 ms"));
}

TEST_F(ChannelAnswer, OfACallFromBeforeTheWallClockWasSetBackIsLoggedWithoutATime) {
  desk.dispatched_call();
  desk.restart();
  desk.now.wall -= 8h;
  desk.link_up();
  desk.wait(0ms);
  reply(desk.reply("1.414", 1));
  EXPECT_THAT(desk.said.back(), EndsWith("answered with state 1"));
}

// Somebody else has asked that instance under the id of our call.
TEST_F(ChannelAnswer, ToAnotherRequestOfTheSameIdIsDroppedAndSaid) {
  desk.dispatched_call();
  fabric::Reply other = desk.reply("3.000", 1);
  other.asked_text = "9";
  reply(other);
  EXPECT_EQ(sut().status().answered, 0U);
  EXPECT_THAT(desk.said.back(), HasSubstr("answers another request than ours under the same id"));
  other = desk.reply("3.000", 1);
  other.asked_state += 1;
  reply(other);
  EXPECT_EQ(sut().status().answered, 0U);
  reply(desk.reply("1.414", 1));
  EXPECT_EQ(sut().status().answered, 1U);
}

TEST_F(ChannelAnswer, IsNotToldToTheInstanceItCameFrom) {
  desk.dispatched_call();
  reply(desk.reply("1.414", 1));
  EXPECT_THAT(desk.left_be(), ElementsAre(instance(1)));
  EXPECT_THAT(desk.withdrawn, IsEmpty());
}

TEST_F(ChannelAnswer, OfOneInstanceIsToldToTheOtherThatWasGivenTheCallToo) {
  desk.dispatched_call();
  const fabric::Reply first = desk.reply("1.414", 1);
  sut().suspend("the instance is lost", false, desk.now);
  desk.settle();
  sut().assign(desk.assignment(2, 2), desk.now);
  desk.settle();
  EXPECT_THAT(desk.withdrawn, ElementsAre(instance(1))) << "it does not hear of the other's call";
  reply(first);
  EXPECT_EQ(sut().status().answered, 1U);
  EXPECT_THAT(desk.withdrawn, ElementsAre(instance(1), instance(2)));
  EXPECT_THAT(desk.left_be(), IsEmpty());
}

TEST_F(ChannelAnswer, OfAnOperatorIsToldToTheInstanceThatHasTheCall) {
  desk.dispatched_call();
  sut().settle({response("by hand", 7), "an operator"}, desk.now);
  desk.settle();
  EXPECT_EQ(sut().status().answered, 1U);
  EXPECT_THAT(desk.withdrawn, ElementsAre(instance(1)));
}

TEST_F(ChannelAnswer, IsFollowedByALookForTheNextRequestAtOnce) {
  desk.dispatched_call();
  const auto reads = desk.reads;
  reply(desk.reply("1.414", 1));
  // One read before the answer, one before it releases the program and one after that, without any
  // time passing.
  EXPECT_EQ(desk.reads, reads + 3);
  EXPECT_EQ(*desk.wake - desk.now.steady, 2ms);
}

TEST_F(ChannelAnswer, IsJournaledBeforeAnythingIsWritten) {
  desk.dispatched_call();
  desk.journal_works = false;
  reply(desk.reply("1.414", 1));
  desk.wait(100ms);
  EXPECT_THAT(desk.writes, IsEmpty());
  EXPECT_EQ(sut().status().state, fabric::ChannelState::answering);
}

TEST_F(ChannelAnswer, DropsTheReplyOfAWithdrawnCall) {
  desk.dispatched_call();
  desk.channel.set_request_state(0);
  reply(desk.reply("1.414", 1));
  EXPECT_THAT(desk.writes, IsEmpty());
  EXPECT_THAT(desk.event_kinds(), ElementsAre(seen, dispatched, replied, withdrawn));
}

TEST_F(ChannelAnswer, DropsTheReplyOfAChangedCallAndTakesTheNewOne) {
  desk.dispatched_call();
  desk.call("3", 1);
  reply(desk.reply("1.414", 1));
  desk.wait(20ms);
  EXPECT_THAT(desk.writes, IsEmpty());
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->request.text, "3");
}

TEST_F(ChannelAnswer, LooksAgainWhenTheJournalTookLong) {
  desk.dispatched_call();
  desk.before_action = [&] { desk.journal_works = desk.writes.empty(); };
  reply(desk.reply("1.414", 1));
  ASSERT_THAT(desk.writes, ElementsAre("RESPONSE=1.414"));
  ASSERT_EQ(desk.unconfirmed.size(), 1U);
  // Between the polls that go on meanwhile, the program gives up and asks something else.
  desk.now.steady += 50ms;
  desk.call("3", 2);
  sut().on_recorded(desk.unconfirmed.front().ticket.number, desk.now);
  desk.settle();
  EXPECT_THAT(desk.writes, ElementsAre("RESPONSE=1.414"));
  EXPECT_EQ(desk.channel.values().request_state, 2U);
}

TEST_F(ChannelAnswer, OfAnEarlierInstanceCountsToo) {
  desk.dispatched_call();
  sut().suspend("instance 1 is lost", false, desk.now);
  desk.settle();
  sut().assign(desk.assignment(2, 2), desk.now);
  desk.settle();
  reply(desk.reply("first", 1, 1));
  reply(desk.reply("second", 1, 2));
  EXPECT_THAT(desk.writes, ElementsAre("RESPONSE=first", "REQUEST_STATE=0", "RESPONSE_STATE=1"));
  EXPECT_EQ(sut().status().late, 1U);
}

TEST_F(ChannelAnswer, OfAHeldCallIsWrittenWhenItsInstanceComesBackWithIt) {
  desk.delivery = fabric::Delivery::at_most_once;
  desk.dispatched_call();
  sut().suspend("lost", true, desk.now);
  desk.settle();
  reply(desk.reply("1.414", 1));
  EXPECT_EQ(desk.channel.values().response_state, 1U);
}

TEST_F(ChannelAnswer, OfAnInstanceThatWasNotAskedIsDropped) {
  desk.dispatched_call();
  reply(desk.reply("1.414", 1, 9));
  EXPECT_THAT(desk.writes, IsEmpty());
  EXPECT_THAT(desk.said.back(), HasSubstr("was not given to it"));
}

TEST_F(ChannelAnswer, OfAnInstanceThatWasNotAskedIsSaidOnceInAWhileHoweverOftenItComes) {
  desk.dispatched_call();
  const auto said = [&] {
    return std::ranges::count_if(desk.said, [](const std::string& text) {
      return text.find("was not given to it") != std::string::npos;
    });
  };
  for (int i = 0; i < 100; ++i) {
    reply(desk.reply("1.414", 1, 9));
  }
  EXPECT_EQ(said(), 1);
  desk.now.steady += 1min;
  reply(desk.reply("1.414", 1, 9));
  EXPECT_EQ(said(), 2);
}

TEST_F(ChannelAnswer, ThatIsLateIsToldOnceOfEachInstanceThatWasAsked) {
  desk.dispatched_call();
  sut().suspend("instance 1 is lost", false, desk.now);
  desk.settle();
  sut().assign(desk.assignment(2, 2), desk.now);
  desk.settle();
  reply(desk.reply("second", 1, 2));
  for (int i = 0; i < 3; ++i) {
    reply(desk.reply("first", 1, 1));
  }
  EXPECT_EQ(sut().status().late, 1U);
}

TEST_F(ChannelAnswer, ToACallThatIsOverIsNotCalledLateIfItsInstanceWasNotAsked) {
  desk.dispatched_call();
  reply(desk.reply("1.414", 1));
  reply(desk.reply("1.414", 1, 9));
  EXPECT_EQ(sut().status().late, 0U);
}

TEST_F(ChannelAnswer, OfAnInstanceThatDeclinesACallThatIsOverIsNotCalledLate) {
  desk.dispatched_call();
  desk.channel.set_request_state(0);
  desk.wait(20ms);
  auto declined = desk.reply("no room", 0);
  declined.kind = fabric::ReplyKind::declined;
  reply(declined);
  EXPECT_EQ(sut().status().late, 0U);
}

// It ran twice: the second attempt was taken from an instance that had begun it.
TEST_F(ChannelAnswer, IsNotRefusedByADeclineOfTheAttemptBefore) {
  desk.dispatched_call();
  sut().suspend("instance 1 is lost", false, desk.now);
  desk.settle();
  sut().assign(desk.assignment(1, 2), desk.now);
  desk.settle();
  auto declined = desk.reply("no room", 0);
  declined.kind = fabric::ReplyKind::declined;
  declined.attempt = 1;
  reply(declined);
  EXPECT_THAT(desk.declined, IsEmpty());
  EXPECT_EQ(sut().status().state, fabric::ChannelState::running);
}

TEST_F(ChannelAnswer, DeliveredTwiceIsWrittenOnceAndNotCalledLate) {
  desk.dispatched_call();
  reply(desk.reply("1.414", 1));
  reply(desk.reply("1.414", 1));
  EXPECT_EQ(desk.writes.size(), 3U);
  EXPECT_EQ(sut().status().late, 0U);
}

TEST_F(ChannelAnswer, ThatComesAfterTheProgramGaveUpIsCalledLate) {
  desk.dispatched_call();
  desk.channel.set_request_state(0);
  desk.wait(20ms);
  reply(desk.reply("1.414", 1));
  EXPECT_THAT(desk.writes, IsEmpty());
  EXPECT_EQ(sut().status().late, 1U);
  EXPECT_EQ(desk.events.back().kind, late);
}

TEST_F(ChannelAnswer, ToACallThatIsOverIsNotWrittenToTheNextOneOfTheSameInstance) {
  desk.dispatched_call();
  const fabric::Reply late = desk.reply("1.414", 1);
  desk.call("3", 2);
  desk.wait(20ms);
  sut().assign(desk.assignment(), desk.now);
  desk.settle();
  reply(late);
  EXPECT_THAT(desk.writes, IsEmpty());
  EXPECT_EQ(sut().status().state, fabric::ChannelState::running);
  EXPECT_EQ(sut().status().late, 1U);
}

TEST_F(ChannelAnswer, WhoseReleaseWasUnderWayWhenTheLinkBrokeIsFoundWritten) {
  desk.dispatched_call();
  desk.before_action = [&] { desk.stop = desk.writes.size() == 3; };
  reply(desk.reply("1.414", 1));
  ASSERT_THAT(desk.writes, ElementsAre("RESPONSE=1.414", "REQUEST_STATE=0", "RESPONSE_STATE=1"));
  desk.before_action = [] {};
  desk.stop = false;
  sut().on_link_dropped("cable", desk.now);
  desk.settle();
  desk.link_up();
  desk.wait(20ms);
  EXPECT_EQ(sut().status().answered, 1U);
  EXPECT_EQ(sut().status().withdrawn, 0U);
  EXPECT_EQ(desk.writes.size(), 3U);
}

TEST_F(ChannelAnswer, OfSomeOtherTimeIsHistoryAndIgnored) {
  desk.link_up();
  auto old = desk.reply("1.414", 1);
  old.call = {99, 1};
  reply(old);
  EXPECT_THAT(desk.events, IsEmpty());
  EXPECT_EQ(sut().status().late, 0U);
}

TEST_F(ChannelAnswer, OfAHandlerThatFailedIsWrittenAsTheServiceSays) {
  desk.dispatched_call();
  auto failed = desk.reply("no such gauge", 99);
  failed.code = fabric::ServiceCode::failed;
  reply(failed);
  EXPECT_EQ(desk.channel.values().response_state, 99U);
  EXPECT_EQ(sut().status().failed, 1U);
}

TEST_F(ChannelAnswer, RefusedByTheControllerIsTriedAgainFromTheLookOn) {
  desk.dispatched_call();
  bool refused_once = false;
  desk.fate = [&] {
    return std::exchange(refused_once, true) ? Fate{} : Fate{WriteOutcome::refused, false};
  };
  reply(desk.reply("1.414", 1));
  EXPECT_THAT(desk.writes, IsEmpty());
  EXPECT_EQ(sut().status().reason, "test");
  desk.wait(2s);
  EXPECT_THAT(desk.writes, ElementsAre("RESPONSE=1.414", "REQUEST_STATE=0", "RESPONSE_STATE=1"));
}

TEST_F(ChannelAnswer, MayBePrecededByInterimStatesThatLeaveTheRequestPending) {
  desk.dispatched_call();
  reply(desk.interim("half way", 5));
  EXPECT_THAT(desk.writes, ElementsAre("RESPONSE=half way", "RESPONSE_STATE=5"));
  EXPECT_EQ(desk.channel.values().request_state, 1U);
  desk.wait(2s);
  reply(desk.reply("done", 1));
  EXPECT_THAT(desk.writes, ElementsAre("RESPONSE=half way", "RESPONSE_STATE=5", "RESPONSE=done",
                                       "REQUEST_STATE=0", "RESPONSE_STATE=1"));
  EXPECT_THAT(desk.event_kinds(), ElementsAre(seen, dispatched, interim, replied, written));
}

TEST_F(ChannelAnswer, FollowsAnInterimStateEvenIfTheKernelClearedTheRequest) {
  renew(desk, {.auto_clear = true});
  desk.dispatched_call();
  reply(desk.interim("half way", 5));
  EXPECT_EQ(desk.channel.values().request_state, 0U);
  desk.wait(2s);
  EXPECT_NE(sut().call(), nullptr);
  reply(desk.reply("done", 1));
  // REQUEST_STATE already reads 0 and is left alone.
  EXPECT_THAT(desk.writes, ElementsAre("RESPONSE=half way", "RESPONSE_STATE=5", "RESPONSE=done",
                                       "RESPONSE_STATE=1"));
}

TEST_F(ChannelAnswer, IsDroppedAfterAnInterimStateThatTheProgramHasWiped) {
  renew(desk, {.auto_clear = true});
  desk.dispatched_call();
  reply(desk.interim("half way", 5));
  desk.channel.set_request_state(0);
  desk.wait(20ms);
  EXPECT_EQ(sut().call(), nullptr);
  EXPECT_THAT(desk.event_kinds(), ElementsAre(seen, dispatched, interim, withdrawn));
}

// The gateway writes no other value than 0: whatever else is read later is the program's.
TEST_F(ChannelAnswer, IsNotGivenToTheSameWordsThatAreAskedAgainAfterAnInterimState) {
  renew(desk, {.response_state_after = 50ms});
  desk.dispatched_call();
  reply(desk.interim("half way", 5));
  desk.channel.set_request_state(0);
  desk.wait(20ms);
  ASSERT_NE(sut().call(), nullptr) << "a kernel may have cleared it";
  desk.call();
  desk.wait(20ms);
  EXPECT_EQ(desk.offers, 2U);
  EXPECT_THAT(desk.event_kinds(), ElementsAre(seen, dispatched, interim, withdrawn, seen));
}

TEST_F(ChannelAnswer, IsNotPrecededByInterimStatesOfAnInstanceThatHasLostTheCall) {
  desk.dispatched_call();
  sut().suspend("instance 1 is lost", false, desk.now);
  desk.settle();
  sut().assign(desk.assignment(2, 2), desk.now);
  desk.settle();
  reply(desk.interim("half way", 5, 1));
  EXPECT_THAT(desk.writes, IsEmpty());
  reply(desk.interim("begun", 4, 2));
  EXPECT_THAT(desk.writes, ElementsAre("RESPONSE=begun", "RESPONSE_STATE=4"));
}

TEST_F(ChannelAnswer, SkipsInterimStatesThatAFinalOneOvertakes) {
  desk.dispatched_call();
  desk.journal_works = false;
  reply(desk.interim("half way", 5));
  // It waits for the one before.
  reply(desk.interim("nearly there", 6));
  reply(desk.reply("done", 1));
  desk.journal_works = true;
  for (const Unconfirmed& record : std::exchange(desk.unconfirmed, {})) {
    desk.ledger.apply(record.entry);
    sut().on_recorded(record.ticket.number, desk.now);
    desk.settle();
  }
  EXPECT_THAT(desk.writes, ElementsAre("RESPONSE=done", "REQUEST_STATE=0", "RESPONSE_STATE=1"));
}

// The manual's words have the program wait for RESPONSE, its sample for RESPONSE_STATE
// (IB/tf5200_service_interface/356533387, documented): a service says which (our choice).
TEST_F(ChannelAnswer, OfState0ReleasesAProgramThatWaitsForTheText) {
  desk.awaited = fabric::Awaited::response;
  desk.dispatched_call();
  reply(desk.reply("1.414", 0));
  EXPECT_THAT(desk.writes, ElementsAre("REQUEST_STATE=0", "RESPONSE=1.414"));
  EXPECT_THAT(desk.event_kinds(), ElementsAre(seen, dispatched, replied, written));
  EXPECT_EQ(sut().status().failed, 0U);
}

TEST_F(ChannelAnswer, OfTheGatewayItselfToAProgramThatWaitsForTheTextEndsWithTheText) {
  desk.awaited = fabric::Awaited::response;
  desk.dispatched_call();
  sut().settle({response("by hand", 7), "an operator"}, desk.now);
  desk.settle();
  EXPECT_THAT(desk.writes, ElementsAre("REQUEST_STATE=0", "RESPONSE_STATE=7", "RESPONSE=by hand"));
}

TEST_F(ChannelAnswer, IsNotPrecededByAnInterimOneIfTheProgramWaitsForTheText) {
  desk.awaited = fabric::Awaited::response;
  desk.dispatched_call();
  reply(desk.interim("half way", 50));
  EXPECT_THAT(desk.writes, IsEmpty());
  EXPECT_THAT(desk.said.back(), HasSubstr("would release the program"));
}

TEST_F(ChannelAnswer, OfState0IsCompletedByARestartedGateway) {
  desk.awaited = fabric::Awaited::response;
  desk.dispatched_call();
  desk.before_action = [&] { desk.stop = desk.channel.values().request_state == 0; };
  reply(desk.reply("1.414", 0));
  ASSERT_THAT(desk.writes, ElementsAre("REQUEST_STATE=0"));
  desk.before_action = [] {};
  desk.restart();
  desk.link_up();
  desk.wait(2s);
  EXPECT_EQ(desk.channel.values().response, "1.414");
  EXPECT_EQ(desk.event_kinds().back(), written);
}

TEST_F(ChannelAnswer, TakesNoInterimStateOf0) {
  desk.dispatched_call();
  reply(desk.interim("half way", 0));
  EXPECT_THAT(desk.writes, IsEmpty());
  EXPECT_EQ(sut().status().state, fabric::ChannelState::running);
}

// The program was released with an empty RESPONSE. Found by the simulation.
TEST_F(ChannelAnswer, WritesTheTextAgainIfTheControllerStartedAgainMeanwhile) {
  desk.dispatched_call();
  desk.before_action = [&] { desk.journal_works = desk.writes.empty(); };
  desk.sut->on_reply(desk.reply("1.414", 1), desk.now);
  desk.settle();
  ASSERT_EQ(desk.writes, std::vector<std::string>{"RESPONSE=1.414"});
  ASSERT_THAT(desk.unconfirmed, testing::SizeIs(1)) << "the journal cannot say that it will clear";
  desk.before_action = [] {};
  desk.journal_works = true;
  desk.sut->on_link_down("the controller is off", desk.now);
  desk.settle();
  desk.channel.reset();
  desk.call();
  desk.sut->on_recorded(desk.unconfirmed.front().ticket.number, desk.now);
  desk.settle();
  desk.link_up();
  desk.wait(std::chrono::milliseconds(20));
  EXPECT_EQ(desk.channel.values().response_state, 1U);
  EXPECT_EQ(desk.channel.values().response, "1.414");
}

// Another gateway, which this one did not hear, had written an interim state. The program waited
// for ever. Found by the simulation.
TEST_F(ChannelAnswer, IsWrittenAgainIfALostReleaseLeavesAStateThatStoodBefore) {
  desk.dispatched_call();
  desk.channel.write(Variable::response_state, Value{std::uint32_t{1003}});
  bool lost_once = false;
  desk.fate = [&] {
    const bool releases = desk.channel.values().request_state == 0;
    return releases && !std::exchange(lost_once, true) ? Fate{WriteOutcome::unknown, false}
                                                       : Fate{};
  };
  reply(desk.reply("1.414", 1));
  desk.wait(2s);
  EXPECT_TRUE(lost_once);
  EXPECT_EQ(desk.channel.values().response_state, 1U);
  EXPECT_EQ(desk.event_kinds().back(), written);
}

TEST_F(ChannelAnswer, IsWrittenAlsoByARestartedGatewayBesideAStateThatStoodBefore) {
  desk.dispatched_call();
  desk.channel.write(Variable::response_state, Value{std::uint32_t{1003}});
  desk.before_action = [&] { desk.stop = desk.channel.values().request_state == 0; };
  reply(desk.reply("1.414", 1));
  ASSERT_TRUE(desk.stop);
  desk.before_action = [] {};
  desk.restart();
  desk.link_up();
  desk.wait(2s);
  EXPECT_EQ(desk.channel.values().response_state, 1U);
}

}  // namespace
}  // namespace millrace::gateway
