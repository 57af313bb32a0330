// How a channel writes answers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/messages/catalogue.hpp"
#include "tests/unit/gateway/channel_fixture.hpp"

namespace millrace::gateway {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using enum fabric::EventKind;
using namespace std::chrono_literals;

class ChannelAnswer : public testing::Test {
 protected:
  channel::Channel& sut() { return *fixture.sut; }
  void reply(const fabric::Reply& reply) { fixture.receive(reply); }
  ChannelFixture fixture;
};

TEST_F(ChannelAnswer, IsWrittenAsResponseThenRequestStateThenResponseState) {
  fixture.dispatched_call();
  reply(fixture.reply("1.414", 1));
  EXPECT_THAT(fixture.writes, ElementsAre("RESPONSE=1.414", "REQUEST_STATE=0", "RESPONSE_STATE=1"));
  EXPECT_EQ(sut().call(), nullptr);
  EXPECT_EQ(sut().status().answered, 1U);
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(seen, dispatched, replied, written));
  EXPECT_THAT(fixture.journal_state.open_calls(), IsEmpty());
}

// A dispatched call was seen 10 ms ago.
TEST_F(ChannelAnswer, IsLoggedWithTheTimeItTookHoweverTheWallClockIsSet) {
  fixture.dispatched_call();
  fixture.wait(50ms);
  fixture.now.wall -= 8h;
  reply(fixture.reply("1.414", 1));
  EXPECT_THAT(fixture.log_lines.back(), EndsWith("answered with state 1 after 60.0 ms"));
}

TEST_F(ChannelAnswer, IsLoggedWithTheTimeOfEachHopIfTheServiceReportsTimes) {
  fixture.dispatched_call();
  fabric::Reply answer = fixture.reply("1.414", 1);
  answer.received = fixture.now.wall + 1ms;
  answer.started = answer.received + 500us;
  answer.answered = answer.started + 2ms;
  fixture.wait(4ms);
  reply(answer);
  EXPECT_THAT(
      fixture.log_lines,
      Contains(EndsWith("11.00 ms until the service had it, 0.50 ms in its queue, 2.00 ms of "
                        "work, 0.50 ms back")));
}

TEST_F(ChannelAnswer, OfAResumedCallIsLoggedWithItsAge) {
  fixture.dispatched_call();
  fixture.restart();
  fixture.wait(1s);
  fixture.link_up();
  fixture.wait(0ms);
  reply(fixture.reply("1.414", 1));
  EXPECT_THAT(fixture.log_lines.back(), EndsWith("answered with state 1 after 1010.0 ms"));
}

TEST_F(ChannelAnswer, OfACallFromBeforeTheWallClockWasSetBackIsLoggedWithoutATime) {
  fixture.dispatched_call();
  fixture.restart();
  fixture.now.wall -= 8h;
  fixture.link_up();
  fixture.wait(0ms);
  reply(fixture.reply("1.414", 1));
  EXPECT_THAT(fixture.log_lines.back(), EndsWith("answered with state 1"));
}

// Another client has requested the instance with the id of our call.
TEST_F(ChannelAnswer, ToAnotherRequestOfTheSameIdIsDroppedAndLogged) {
  fixture.dispatched_call();
  fabric::Reply other = fixture.reply("3.000", 1);
  other.asked_text = "9";
  reply(other);
  EXPECT_EQ(sut().status().answered, 0U);
  EXPECT_THAT(fixture.log_lines.back(),
              HasSubstr("replies to another request with the same call id"));
  other = fixture.reply("3.000", 1);
  other.asked_state += 1;
  reply(other);
  EXPECT_EQ(sut().status().answered, 0U);
  reply(fixture.reply("1.414", 1));
  EXPECT_EQ(sut().status().answered, 1U);
}

TEST_F(ChannelAnswer, WithdrawsNothingFromTheInstanceItCameFrom) {
  fixture.dispatched_call();
  reply(fixture.reply("1.414", 1));
  EXPECT_THAT(fixture.left_be(), ElementsAre(instance(1)));
  EXPECT_THAT(fixture.withdrawn, IsEmpty());
}

TEST_F(ChannelAnswer, OfOneInstanceWithdrawsTheAttemptOfTheOther) {
  fixture.dispatched_call();
  const fabric::Reply first = fixture.reply("1.414", 1);
  fixture.suspend("the instance is lost", false);
  fixture.assign(2, 2);
  EXPECT_THAT(fixture.withdrawn, ElementsAre(instance(1))) << "it does not know the other's call";
  reply(first);
  EXPECT_EQ(sut().status().answered, 1U);
  EXPECT_THAT(fixture.withdrawn, ElementsAre(instance(1), instance(2)));
  EXPECT_THAT(fixture.left_be(), IsEmpty());
}

TEST_F(ChannelAnswer, OfAnOperatorWithdrawsTheAttemptOfTheInstance) {
  fixture.dispatched_call();
  fixture.answer("by hand", 7, "an operator");
  EXPECT_EQ(sut().status().answered, 1U);
  EXPECT_THAT(fixture.withdrawn, ElementsAre(instance(1)));
}

TEST_F(ChannelAnswer, IsFollowedByAReadForTheNextRequestAtOnce) {
  fixture.dispatched_call();
  const auto reads = fixture.reads;
  reply(fixture.reply("1.414", 1));
  // One read before the answer, one before the release and one after it, without any time passing.
  EXPECT_EQ(fixture.reads, reads + 3);
  EXPECT_EQ(*fixture.wake - fixture.now.steady, 2ms);
}

TEST_F(ChannelAnswer, IsJournaledBeforeAnythingIsWritten) {
  fixture.dispatched_call();
  fixture.journal_works = false;
  reply(fixture.reply("1.414", 1));
  fixture.wait(100ms);
  EXPECT_THAT(fixture.writes, IsEmpty());
  EXPECT_EQ(sut().status().state, fabric::ChannelState::answering);
}

TEST_F(ChannelAnswer, DropsTheReplyOfAWithdrawnCall) {
  fixture.dispatched_call();
  fixture.channel.set_request_state(0);
  reply(fixture.reply("1.414", 1));
  EXPECT_THAT(fixture.writes, IsEmpty());
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(seen, dispatched, replied, withdrawn));
}

TEST_F(ChannelAnswer, DropsTheReplyOfAChangedCallAndAcceptsTheNewOne) {
  fixture.dispatched_call();
  fixture.call("3", 1);
  reply(fixture.reply("1.414", 1));
  fixture.wait(20ms);
  EXPECT_THAT(fixture.writes, IsEmpty());
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->request.text, "3");
}

TEST_F(ChannelAnswer, ReadsAgainWhenTheJournalTookLong) {
  fixture.dispatched_call();
  fixture.before_action = [&] { fixture.journal_works = fixture.writes.empty(); };
  reply(fixture.reply("1.414", 1));
  ASSERT_THAT(fixture.writes, ElementsAre("RESPONSE=1.414"));
  ASSERT_EQ(fixture.unconfirmed.size(), 1U);
  // Between the polls that continue, the program gives up and sends another request.
  fixture.now.steady += 50ms;
  fixture.call("3", 2);
  fixture.confirm();
  EXPECT_THAT(fixture.writes, ElementsAre("RESPONSE=1.414"));
  EXPECT_EQ(fixture.channel.values().request_state, 2U);
}

TEST_F(ChannelAnswer, OfAnEarlierInstanceCountsToo) {
  fixture.dispatched_call();
  fixture.suspend("instance 1 is lost", false);
  fixture.assign(2, 2);
  reply(fixture.reply("first", 1, 1));
  reply(fixture.reply("second", 1, 2));
  EXPECT_THAT(fixture.writes, ElementsAre("RESPONSE=first", "REQUEST_STATE=0", "RESPONSE_STATE=1"));
  EXPECT_EQ(sut().status().late, 1U);
}

TEST_F(ChannelAnswer, OfABlockedCallIsWrittenWhenItsInstanceReturnsWithIt) {
  fixture.blocked_call();
  reply(fixture.reply("1.414", 1));
  EXPECT_EQ(fixture.channel.values().response_state, 1U);
}

TEST_F(ChannelAnswer, OfAnInstanceWithoutTheCallIsDropped) {
  fixture.dispatched_call();
  reply(fixture.reply("1.414", 1, 9));
  EXPECT_THAT(fixture.writes, IsEmpty());
  EXPECT_THAT(fixture.log_lines.back(), HasSubstr("was not dispatched to it"));
}

TEST_F(ChannelAnswer, OfAnInstanceWithoutTheCallIsRarelyLogged) {
  fixture.dispatched_call();
  const auto times_logged = [&] {
    return std::ranges::count_if(fixture.log_lines, [](const std::string& text) {
      return text.find("was not dispatched to it") != std::string::npos;
    });
  };
  for (int i = 0; i < 100; ++i) {
    reply(fixture.reply("1.414", 1, 9));
  }
  EXPECT_EQ(times_logged(), 1);
  fixture.now.steady += 1min;
  reply(fixture.reply("1.414", 1, 9));
  EXPECT_EQ(times_logged(), 2);
}

TEST_F(ChannelAnswer, ThatIsLateIsReportedOnceForEachInstance) {
  fixture.dispatched_call();
  fixture.suspend("instance 1 is lost", false);
  fixture.assign(2, 2);
  reply(fixture.reply("second", 1, 2));
  for (int i = 0; i < 3; ++i) {
    reply(fixture.reply("first", 1, 1));
  }
  EXPECT_EQ(sut().status().late, 1U);
}

TEST_F(ChannelAnswer, ToACallThatIsOverIsNotReportedLateIfItsInstanceDidNotHaveIt) {
  fixture.dispatched_call();
  reply(fixture.reply("1.414", 1));
  reply(fixture.reply("1.414", 1, 9));
  EXPECT_EQ(sut().status().late, 0U);
}

TEST_F(ChannelAnswer, OfAnInstanceThatDeclinesACallThatIsOverIsNotReportedLate) {
  fixture.dispatched_call();
  fixture.channel.set_request_state(0);
  fixture.wait(20ms);
  auto declined = fixture.reply("no room", 0);
  declined.kind = fabric::ReplyKind::declined;
  reply(declined);
  EXPECT_EQ(sut().status().late, 0U);
}

TEST_F(ChannelAnswer, ThatDeclinesTheCallIsTheCauseThatItWaits) {
  fixture.dispatched_call();
  auto declined = fixture.reply("no room", 0);
  declined.kind = fabric::ReplyKind::declined;
  reply(declined);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::waiting);
  EXPECT_EQ(sut().status().reason.code, "declined");
}

// The reason comes from another process, and its text reaches logs and terminals.
TEST_F(ChannelAnswer, ThatDeclinesTheCallShowsItsReasonWithoutControlCharacters) {
  fixture.dispatched_call();
  auto declined = fixture.reply("", 0);
  declined.kind = fabric::ReplyKind::declined;
  declined.reason = base::messages::no_room("\x1b[2J");
  reply(declined);
  const fabric::Message& reason = sut().status().reason;
  ASSERT_EQ(reason.arguments.size(), 2U);
  EXPECT_EQ(reason.arguments[1].code, "no_room");
  EXPECT_EQ(reason.arguments[1].text, "it runs at most ?[2J calls at once");
  EXPECT_EQ(reason.text.find('\x1b'), std::string::npos);
}

// A regression: it ran twice, because the second attempt was taken away from an instance that had
// begun it.
TEST_F(ChannelAnswer, IsNotRefusedByADeclineOfTheAttemptBefore) {
  fixture.dispatched_call();
  fixture.suspend("instance 1 is lost", false);
  fixture.assign(1, 2);
  auto declined = fixture.reply("no room", 0);
  declined.kind = fabric::ReplyKind::declined;
  declined.attempt = 1;
  reply(declined);
  EXPECT_THAT(fixture.declined, IsEmpty());
  EXPECT_EQ(sut().status().state, fabric::ChannelState::running);
}

TEST_F(ChannelAnswer, DeliveredTwiceIsWrittenOnceAndNotReportedLate) {
  fixture.dispatched_call();
  reply(fixture.reply("1.414", 1));
  reply(fixture.reply("1.414", 1));
  EXPECT_EQ(fixture.writes.size(), 3U);
  EXPECT_EQ(sut().status().late, 0U);
}

TEST_F(ChannelAnswer, ThatComesAfterTheProgramGaveUpIsReportedLate) {
  fixture.dispatched_call();
  fixture.channel.set_request_state(0);
  fixture.wait(20ms);
  reply(fixture.reply("1.414", 1));
  EXPECT_THAT(fixture.writes, IsEmpty());
  EXPECT_EQ(sut().status().late, 1U);
  EXPECT_EQ(fixture.events.back().kind, late);
}

TEST_F(ChannelAnswer, ToACallThatIsOverIsNotWrittenToTheNextOneOfTheSameInstance) {
  fixture.dispatched_call();
  const fabric::Reply late = fixture.reply("1.414", 1);
  fixture.call("3", 2);
  fixture.wait(20ms);
  fixture.assign();
  reply(late);
  EXPECT_THAT(fixture.writes, IsEmpty());
  EXPECT_EQ(sut().status().state, fabric::ChannelState::running);
  EXPECT_EQ(sut().status().late, 1U);
}

TEST_F(ChannelAnswer, WhoseReleaseWasUnderWayWhenTheLinkBrokeIsFoundWritten) {
  fixture.dispatched_call();
  fixture.before_action = [&] { fixture.stop = fixture.writes.size() == 3; };
  reply(fixture.reply("1.414", 1));
  ASSERT_THAT(fixture.writes, ElementsAre("RESPONSE=1.414", "REQUEST_STATE=0", "RESPONSE_STATE=1"));
  fixture.before_action = [] {};
  fixture.stop = false;
  sut().on_link_dropped("cable", fixture.now);
  fixture.settle();
  fixture.link_up();
  fixture.wait(20ms);
  EXPECT_EQ(sut().status().answered, 1U);
  EXPECT_EQ(sut().status().withdrawn, 0U);
  EXPECT_EQ(fixture.writes.size(), 3U);
}

TEST_F(ChannelAnswer, OfAnUnknownCallIsIgnored) {
  fixture.link_up();
  auto old = fixture.reply("1.414", 1);
  old.call = {99, 1};
  reply(old);
  EXPECT_THAT(fixture.events, IsEmpty());
  EXPECT_EQ(sut().status().late, 0U);
}

TEST_F(ChannelAnswer, OfAFailedHandlerIsWrittenAsTheServiceSentIt) {
  fixture.dispatched_call();
  auto failed = fixture.reply("no such gauge", 99);
  failed.code = fabric::ServiceCode::failed;
  reply(failed);
  EXPECT_EQ(fixture.channel.values().response_state, 99U);
  EXPECT_EQ(sut().status().failed, 1U);
}

TEST_F(ChannelAnswer, RefusedByTheControllerIsRepeatedFromTheReadOn) {
  fixture.dispatched_call();
  bool refused_once = false;
  fixture.write_result = [&] {
    return std::exchange(refused_once, true) ? WriteResult{}
                                             : WriteResult{WriteOutcome::refused, false};
  };
  reply(fixture.reply("1.414", 1));
  EXPECT_THAT(fixture.writes, IsEmpty());
  EXPECT_EQ(sut().status().reason, "test");
  fixture.wait(2s);
  EXPECT_THAT(fixture.writes, ElementsAre("RESPONSE=1.414", "REQUEST_STATE=0", "RESPONSE_STATE=1"));
}

TEST_F(ChannelAnswer, MayBePrecededByInterimStatesThatLeaveTheRequestPending) {
  fixture.dispatched_call();
  reply(fixture.interim("half way", 5));
  EXPECT_THAT(fixture.writes, ElementsAre("RESPONSE=half way", "RESPONSE_STATE=5"));
  EXPECT_EQ(fixture.channel.values().request_state, 1U);
  fixture.wait(2s);
  reply(fixture.reply("done", 1));
  EXPECT_THAT(fixture.writes, ElementsAre("RESPONSE=half way", "RESPONSE_STATE=5", "RESPONSE=done",
                                          "REQUEST_STATE=0", "RESPONSE_STATE=1"));
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(seen, dispatched, interim, replied, written));
}

TEST_F(ChannelAnswer, FollowsAnInterimStateEvenIfTheKernelClearedTheRequest) {
  renew(fixture, {.auto_clear = true});
  fixture.dispatched_call();
  reply(fixture.interim("half way", 5));
  EXPECT_EQ(fixture.channel.values().request_state, 0U);
  fixture.wait(2s);
  EXPECT_NE(sut().call(), nullptr);
  reply(fixture.reply("done", 1));
  // REQUEST_STATE already reads 0 and is not written.
  EXPECT_THAT(fixture.writes, ElementsAre("RESPONSE=half way", "RESPONSE_STATE=5", "RESPONSE=done",
                                          "RESPONSE_STATE=1"));
}

TEST_F(ChannelAnswer, IsDroppedAfterAnInterimStateThatTheProgramHasCleared) {
  renew(fixture, {.auto_clear = true});
  fixture.dispatched_call();
  reply(fixture.interim("half way", 5));
  fixture.channel.set_request_state(0);
  fixture.wait(20ms);
  EXPECT_EQ(sut().call(), nullptr);
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(seen, dispatched, interim, withdrawn));
}

// The gateway writes only 0: any other value that is read later is the program's.
TEST_F(ChannelAnswer, IsNotGivenToTheSameRequestMadeAgainAfterAnInterimState) {
  renew(fixture, {.response_state_after = 50ms});
  fixture.dispatched_call();
  reply(fixture.interim("half way", 5));
  fixture.channel.set_request_state(0);
  fixture.wait(20ms);
  ASSERT_NE(sut().call(), nullptr) << "a kernel may have cleared it";
  fixture.call();
  fixture.wait(20ms);
  EXPECT_EQ(fixture.offers, 2U);
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(seen, dispatched, interim, withdrawn, seen));
}

TEST_F(ChannelAnswer, IsNotPrecededByInterimStatesOfAnInstanceThatHasLostTheCall) {
  fixture.dispatched_call();
  fixture.suspend("instance 1 is lost", false);
  fixture.assign(2, 2);
  reply(fixture.interim("half way", 5, 1));
  EXPECT_THAT(fixture.writes, IsEmpty());
  reply(fixture.interim("begun", 4, 2));
  EXPECT_THAT(fixture.writes, ElementsAre("RESPONSE=begun", "RESPONSE_STATE=4"));
}

TEST_F(ChannelAnswer, SkipsInterimStatesThatAFinalOneOvertakes) {
  fixture.dispatched_call();
  fixture.journal_works = false;
  reply(fixture.interim("half way", 5));
  // It waits for the one before.
  reply(fixture.interim("nearly there", 6));
  reply(fixture.reply("done", 1));
  fixture.journal_works = true;
  for (const Unconfirmed& record : std::exchange(fixture.unconfirmed, {})) {
    fixture.journal_state.apply(record.entry);
    sut().on_recorded(record.ticket.number, fixture.now);
    fixture.settle();
  }
  EXPECT_THAT(fixture.writes, ElementsAre("RESPONSE=done", "REQUEST_STATE=0", "RESPONSE_STATE=1"));
}

// By the text of the manual, the program waits for RESPONSE; by its sample, for RESPONSE_STATE
// (IB/tf5200_service_interface/356533387, documented). A service declares which (our choice).
TEST_F(ChannelAnswer, OfState0ReleasesAProgramThatWaitsForTheText) {
  fixture.completion_signal = fabric::CompletionSignal::response;
  fixture.dispatched_call();
  reply(fixture.reply("1.414", 0));
  EXPECT_THAT(fixture.writes, ElementsAre("REQUEST_STATE=0", "RESPONSE=1.414"));
  EXPECT_THAT(fixture.event_kinds(), ElementsAre(seen, dispatched, replied, written));
  EXPECT_EQ(sut().status().failed, 0U);
}

TEST_F(ChannelAnswer, OfTheGatewayItselfToAProgramThatWaitsForTheTextEndsWithTheText) {
  fixture.completion_signal = fabric::CompletionSignal::response;
  fixture.dispatched_call();
  fixture.answer("by hand", 7, "an operator");
  EXPECT_THAT(fixture.writes,
              ElementsAre("REQUEST_STATE=0", "RESPONSE_STATE=7", "RESPONSE=by hand"));
}

TEST_F(ChannelAnswer, IsNotPrecededByAnInterimOneIfTheProgramWaitsForTheText) {
  fixture.completion_signal = fabric::CompletionSignal::response;
  fixture.dispatched_call();
  reply(fixture.interim("half way", 50));
  EXPECT_THAT(fixture.writes, IsEmpty());
  EXPECT_THAT(fixture.log_lines.back(), HasSubstr("would release the NC program"));
}

TEST_F(ChannelAnswer, OfState0IsCompletedByARestartedGateway) {
  fixture.completion_signal = fabric::CompletionSignal::response;
  fixture.dispatched_call();
  fixture.before_action = [&] { fixture.stop = fixture.channel.values().request_state == 0; };
  reply(fixture.reply("1.414", 0));
  ASSERT_THAT(fixture.writes, ElementsAre("REQUEST_STATE=0"));
  fixture.before_action = [] {};
  fixture.restart();
  fixture.link_up();
  fixture.wait(2s);
  EXPECT_EQ(fixture.channel.values().response, "1.414");
  EXPECT_EQ(fixture.event_kinds().back(), written);
}

TEST_F(ChannelAnswer, IgnoresAnInterimStateOf0) {
  fixture.dispatched_call();
  reply(fixture.interim("half way", 0));
  EXPECT_THAT(fixture.writes, IsEmpty());
  EXPECT_EQ(sut().status().state, fabric::ChannelState::running);
}

// A regression: the program was released with an empty RESPONSE. Found by the simulation.
TEST_F(ChannelAnswer, WritesTheTextAgainIfTheControllerRestartedInBetween) {
  fixture.dispatched_call();
  fixture.before_action = [&] { fixture.journal_works = fixture.writes.empty(); };
  fixture.receive(fixture.reply("1.414", 1));
  ASSERT_EQ(fixture.writes, std::vector<std::string>{"RESPONSE=1.414"});
  ASSERT_THAT(fixture.unconfirmed, testing::SizeIs(1)) << "the clearing cannot be journalled";
  fixture.before_action = [] {};
  fixture.journal_works = true;
  fixture.link_down("the controller is off");
  fixture.channel.reset();
  fixture.call();
  fixture.confirm();
  fixture.link_up();
  fixture.wait(std::chrono::milliseconds(20));
  EXPECT_EQ(fixture.channel.values().response_state, 1U);
  EXPECT_EQ(fixture.channel.values().response, "1.414");
}

// A regression: another gateway, which this one did not hear, had written an interim state, and the
// program waited for ever. Found by the simulation.
TEST_F(ChannelAnswer, IsWrittenAgainIfALostReleaseLeavesAStateThatStoodBefore) {
  fixture.dispatched_call();
  fixture.channel.write(Variable::response_state, Value{std::uint32_t{1003}});
  bool lost_once = false;
  fixture.write_result = [&] {
    const bool releases = fixture.channel.values().request_state == 0;
    return releases && !std::exchange(lost_once, true) ? WriteResult{WriteOutcome::unknown, false}
                                                       : WriteResult{};
  };
  reply(fixture.reply("1.414", 1));
  fixture.wait(2s);
  EXPECT_TRUE(lost_once);
  EXPECT_EQ(fixture.channel.values().response_state, 1U);
  EXPECT_EQ(fixture.event_kinds().back(), written);
}

TEST_F(ChannelAnswer, IsWrittenAlsoByARestartedGatewayBesideAStateThatStoodBefore) {
  fixture.dispatched_call();
  fixture.channel.write(Variable::response_state, Value{std::uint32_t{1003}});
  fixture.before_action = [&] { fixture.stop = fixture.channel.values().request_state == 0; };
  reply(fixture.reply("1.414", 1));
  ASSERT_TRUE(fixture.stop);
  fixture.before_action = [] {};
  fixture.restart();
  fixture.link_up();
  fixture.wait(2s);
  EXPECT_EQ(fixture.channel.values().response_state, 1U);
}

// A regression: an observer took the call for withdrawn by its NC program, which had this response.
// Found by the simulation.
TEST_F(ChannelAnswer, IsNoWithdrawalWhereItMayHaveReleasedTheProgramBeforeAnotherWriter) {
  fixture.dispatched_call();
  fixture.write_result = [&] {
    if (fixture.channel.values().request_state != 0) {
      return WriteResult{};
    }
    fixture.channel.write(Variable::response_state, Value{std::uint32_t{500}});  // another gateway
    return WriteResult{WriteOutcome::unknown, false};
  };
  reply(fixture.reply("1.414", 1));
  fixture.wait(2s);
  EXPECT_EQ(sut().call(), nullptr);
  EXPECT_EQ(fixture.events.back().kind, written);
  EXPECT_THAT(fixture.events.back().detail,
              AllOf(testing::HasSubstr("another writer set RESPONSE_STATE to 500"),
                    testing::HasSubstr("may have got this response")));
  EXPECT_EQ(sut().status().withdrawn, 0U);
  EXPECT_EQ(fixture.channel.values().response_state, 500U) << "the other response stays";
}

}  // namespace
}  // namespace millrace::gateway
