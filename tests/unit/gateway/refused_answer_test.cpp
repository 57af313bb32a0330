// What a channel cannot take is refused where it arrives, and the program is told.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/reply_kind.hpp"
#include "gateway/response.hpp"
#include "tests/unit/gateway/desk.hpp"

namespace millrace::gateway {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::StartsWith;
using enum fabric::EventKind;
using namespace std::chrono_literals;

const std::string with_nul("1.4\0 14", 7);
const std::string too_long(128, 'x');

TEST(AResponse, OfWhatAChannelTakesIsTakenAsItIs) {
  const auto sut = Response::of(std::string(127, '\xe4'), 7);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->text(), std::string(127, '\xe4'));
  EXPECT_EQ(sut->state(), 7U);
}

TEST(AResponse, SaysWhyAChannelCannotTakeIt) {
  EXPECT_EQ(Response::of(too_long, 1).error(), "has 128 bytes, at most 127 fit");
  EXPECT_THAT(Response::of(with_nul, 1).error(), HasSubstr("a NUL at byte 3"));
  EXPECT_THAT(Response::of("x", 0).error(), HasSubstr("state 0"));
}

TEST(AResponse, ToAProgramThatWaitsForTheTextHasOneAndAnyState) {
  EXPECT_TRUE(Response::of("x", 0, fabric::Awaited::response));
  EXPECT_TRUE(Response::of("x", 99, fabric::Awaited::response));
  EXPECT_THAT(Response::of("", 1, fabric::Awaited::response).error(),
              HasSubstr("is empty, which releases no program"));
  EXPECT_TRUE(Response::of("", 1));
}

TEST(AResponse, InWordsOfOursAlwaysFits) {
  EXPECT_EQ(Response::in_words(with_nul, 1).text(), "1.4? 14");
  EXPECT_EQ(Response::in_words(too_long, 1).text(), std::string(124, 'x') + "...");
}

class RefusedAnswer : public testing::Test {
 protected:
  channel::ChannelSession& sut() { return *desk.sut; }
  void reply(const fabric::Reply& reply) {
    sut().on_reply(reply, desk.now);
    desk.settle();
  }
  void expect_told(const std::string& text, std::uint32_t state) {
    EXPECT_THAT(desk.writes, ElementsAre("RESPONSE=" + text, "REQUEST_STATE=0",
                                         fmt::format("RESPONSE_STATE={}", state)));
    EXPECT_EQ(sut().call(), nullptr);
    EXPECT_THAT(desk.ledger.open_calls(), IsEmpty());
  }
  Desk desk;
};

TEST_F(RefusedAnswer, GivesTheProgramTheErrorAndState500AtOnce) {
  for (const auto& [text, state, error] :
       {std::tuple(std::string("x"), 0U, "has state 0, which releases no program"),
        {too_long, 1U, "has 128 bytes, at most 127 fit"},
        {with_nul, 1U, "has a NUL at byte 3, where a CNC string would end"}}) {
    renew(desk);
    desk.dispatched_call();
    reply(desk.reply(text, state));
    expect_told(fmt::format("ERROR: the service's answer {}", error), 500);
    EXPECT_THAT(desk.event_kinds(), ElementsAre(seen, dispatched, refused, replied, written));
    EXPECT_EQ(sut().status().failed, 1U);
    EXPECT_THAT(desk.left_be(), SizeIs(1)) << "its instance has answered, as badly as it may be";
  }
}

// Of a later version, or of nobody's.
TEST_F(RefusedAnswer, OfAKindThatNobodyKnowsIsToldToo) {
  desk.dispatched_call();
  auto said = desk.reply("4", 1);
  said.kind = fabric::unknown_kind;
  reply(said);
  expect_told("ERROR: the service's answer is of a kind that this gateway does not know", 500);
  EXPECT_THAT(desk.event_kinds(), ElementsAre(seen, dispatched, refused, replied, written));
}

TEST_F(RefusedAnswer, OfAServiceThatSaysSoItselfIsWrittenAsItSays) {
  desk.dispatched_call();
  auto said = desk.reply("ERROR: the service's answer has 200 bytes, at most 127 fit", 99);
  said.code = fabric::ServiceCode::refused;
  reply(said);
  expect_told("ERROR: the service's answer has 200 bytes, at most 127 fit", 99);
}

TEST_F(RefusedAnswer, IsWrittenWithTheStateOfAPolicy) {
  desk.policy.refused = Rule{0s, 904};
  desk.dispatched_call();
  reply(desk.reply(too_long, 1));
  expect_told("ERROR: the service's answer has 128 bytes, at most 127 fit", 904);
}

TEST_F(RefusedAnswer, IsHeldForAnOperatorWhereAPolicySaysSo) {
  desk.policy.refused = Rule{};
  desk.dispatched_call();
  reply(desk.reply(too_long, 1));
  desk.wait(1h);
  EXPECT_THAT(desk.writes, IsEmpty());
  EXPECT_EQ(sut().status().state, fabric::ChannelState::held);
  EXPECT_THAT(sut().status().reason, HasSubstr("an operator must answer or retry it"));
  EXPECT_EQ(desk.freed, 1U) << "its instance is free for another call";
  sut().settle({response("go on", 7), "ann@hmi"}, desk.now);
  desk.settle();
  expect_told("go on", 7);
}

TEST_F(RefusedAnswer, ThatIsDeliveredAgainChangesNothing) {
  desk.policy.refused = Rule{};
  desk.dispatched_call();
  reply(desk.reply(too_long, 1));
  sut().retry("ann@hmi", desk.now);
  desk.settle();
  reply(desk.reply(too_long, 1));
  EXPECT_EQ(sut().status().state, fabric::ChannelState::waiting);
  EXPECT_EQ(sut().status().failed, 1U);
  auto again = desk.reply(too_long, 1);
  again.attempt = 2;
  sut().assign(desk.assignment(1, 2), desk.now);
  desk.settle();
  reply(again);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::held);
}

// A service of another make leaves the attempt out of its replies; its next answer was taken for
// the refused one, and the program waited. Found by the simulation, seeds 1069 and 2145.
TEST_F(RefusedAnswer, IsNotMistakenForTheNextOneOfAServiceThatCountsNoAttempts) {
  desk.policy.refused = Rule{};
  desk.dispatched_call();
  const auto said = [&](const std::string& text, std::chrono::seconds at) {
    auto reply = desk.reply(text, 1);
    reply.attempt = 0;
    reply.answered = fabric::Time(at);
    return reply;
  };
  reply(said(too_long, 1s));
  sut().retry("ann@hmi", desk.now);
  desk.settle();
  sut().assign(desk.assignment(1, 2), desk.now);
  desk.settle();
  reply(said(too_long, 1s));
  EXPECT_EQ(sut().status().state, fabric::ChannelState::running) << "delivered again";
  reply(said(too_long, 2s));
  EXPECT_EQ(sut().status().state, fabric::ChannelState::held) << "once more what cannot be written";
  sut().retry("ann@hmi", desk.now);
  desk.settle();
  sut().assign(desk.assignment(1, 3), desk.now);
  desk.settle();
  reply(said("1.41421", 3s));
  expect_told("1.41421", 1);
}

// A power cut took the attempt from the journal, not its answer from the fabric; the answer to the
// one that got its number was taken for it, and the program waited. Seed 1013540.
TEST_F(RefusedAnswer, OfAnAttemptThatTheJournalLostIsNotMistakenForThatOfTheNext) {
  desk.policy.refused = Rule{};
  desk.dispatched_call();
  auto said = desk.reply(too_long, 1);
  said.attempt = 2;
  reply(said);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::held);
  sut().retry("ann@hmi", desk.now);
  desk.settle();
  sut().assign(desk.assignment(1, 2), desk.now);
  desk.settle();
  EXPECT_EQ(sut().status().state, fabric::ChannelState::running);
  reply(said);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::held)
      << "its instance remembers its answer";
}

TEST_F(RefusedAnswer, IsRememberedAmongTheLastSixteenOfACallThatIsHeld) {
  desk.policy.refused = Rule{};
  desk.dispatched_call();
  const auto said = [&](int second) {
    auto reply = desk.reply(too_long, 1);
    reply.answered = fabric::Time(std::chrono::seconds(second));
    return reply;
  };
  for (int second = 1; second <= 17; ++second) {
    reply(said(second));
  }
  EXPECT_EQ(sut().status().failed, 17U);
  reply(said(2));
  EXPECT_EQ(sut().status().failed, 17U) << "it is known";
  reply(said(1));
  EXPECT_EQ(sut().status().failed, 18U) << "it was the seventeenth from the end";
}

// The gateway was killed by its own assertion. Found by the simulation, seed 918109 and others.
TEST_F(RefusedAnswer, MayComeWhileTheJournalIsToldOfTheNextAttempt) {
  for (const auto& policy : {std::optional<Rule>(), std::optional(Rule{})}) {
    renew(desk);
    desk.policy.refused = policy;
    desk.dispatched_call();
    sut().suspend("instance 1 is lost", false, desk.now);
    desk.settle();
    desk.journal_works = false;
    sut().assign(desk.assignment(2, 2), desk.now);
    desk.settle();
    reply(desk.reply("x", 0, 1));
    ASSERT_FALSE(desk.unconfirmed.empty());
    desk.journal_works = true;
    const auto records = desk.unconfirmed;
    for (const Unconfirmed& record : records) {
      desk.ledger.apply(record.entry);
      sut().on_recorded(record.ticket.number, desk.now);
      desk.settle();
    }
    EXPECT_THAT(desk.published, SizeIs(1)) << "the next attempt is not given out any more";
    EXPECT_EQ(sut().call() == nullptr, !policy) << "answered, or held";
  }
}

// It was given out before the journal knew of it.
TEST_F(RefusedAnswer, OrNoneAnAttemptThatIsRepeatedWaitsForTheJournal) {
  desk.link_up();
  desk.call();
  desk.wait(20ms);
  desk.delivery = fabric::Delivery::at_most_once;
  desk.journal_works = false;
  sut().assign(desk.assignment(), desk.now);
  desk.settle();
  sut().suspend("lost", true, desk.now);
  desk.settle();
  sut().assign(desk.assignment(), desk.now);
  desk.settle();
  EXPECT_THAT(desk.published, IsEmpty());
  ASSERT_THAT(desk.unconfirmed, SizeIs(1));
  sut().on_recorded(desk.unconfirmed.front().ticket.number, desk.now);
  desk.settle();
  EXPECT_THAT(desk.published, SizeIs(1));
}

TEST_F(RefusedAnswer, OnTheWayToTheAnswerIsLeftOutAndSaidOnce) {
  desk.dispatched_call();
  for (const std::string& text : {with_nul, too_long}) {
    reply(desk.interim(text, 5));
  }
  desk.wait(1s);
  EXPECT_THAT(desk.writes, IsEmpty());
  EXPECT_EQ(sut().status().state, fabric::ChannelState::running);
  reply(desk.interim("half way", 5));
  reply(desk.reply("done", 1));
  EXPECT_THAT(desk.writes, ElementsAre("RESPONSE=half way", "RESPONSE_STATE=5", "RESPONSE=done",
                                       "REQUEST_STATE=0", "RESPONSE_STATE=1"));
}

/// A journal that an earlier version has written, which took such answers.
class AJournalWithAnAnswerThatCannotBeWritten : public RefusedAnswer {
 protected:
  void restart_with(const Answer& answer) {
    desk.dispatched_call();
    desk.ledger.apply(AnsweredEntry{{0x5f3a, 1}, answer});
    desk.restart();
  }
};

TEST_F(AJournalWithAnAnswerThatCannotBeWritten, FreesTheChannelAfterARestart) {
  restart_with({instance(1), 1, with_nul, 1});
  desk.link_up();
  desk.wait(20ms);
  expect_told("ERROR: the answer in the journal has a NUL at byte 3, where a CNC string would end",
              500);
  EXPECT_EQ(desk.resumed, 0U) << "nobody is asked anew";
}

TEST_F(AJournalWithAnAnswerThatCannotBeWritten, IsNotWrittenOnceTheProgramHasMovedOn) {
  restart_with({instance(1), 1, with_nul, 1});
  desk.channel.set_request_state(0);
  desk.link_up();
  desk.wait(1s);
  EXPECT_THAT(desk.writes, IsEmpty());
  EXPECT_THAT(desk.ledger.open_calls(), IsEmpty());
}

TEST_F(AJournalWithAnAnswerThatCannotBeWritten, MayBeAnsweredBeforeTheLinkIsUp) {
  restart_with({instance(1), 1, with_nul, 1});
  sut().settle({response("go on", 7), "ann@hmi"}, desk.now);
  desk.settle();
  desk.link_up();
  desk.wait(20ms);
  expect_told("go on", 7);
}

TEST_F(AJournalWithAnAnswerThatCannotBeWritten, IsHeldWhereAPolicySaysSo) {
  desk.policy.refused = Rule{};
  restart_with({instance(1), 1, with_nul, 1});
  desk.link_up();
  desk.wait(1s);
  EXPECT_THAT(desk.writes, IsEmpty());
  EXPECT_EQ(sut().status().state, fabric::ChannelState::held);
}

}  // namespace
}  // namespace millrace::gateway
