#include "tests/simulation/history/outcome_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::tests::simulation {
namespace {

using fabric::EventKind;
using testing::ElementsAre;
using testing::EndsWith;
using testing::IsEmpty;

constexpr fabric::CallId call{0x5f, 17};
const Key channel{"cnc", 1};
constexpr fabric::InstanceId instance{{1}};

class AnOutcomeCheck : public testing::Test {
 protected:
  AnOutcomeCheck() {
    add(Claimed{.key = channel, .call = call, .request = {}});
    add(Dispatched{.key = channel, .call = call, .attempt = 1, .instance = instance});
    publish(EventKind::seen, {});
    publish(EventKind::dispatched, instance);
  }

  void add(const Fact& fact) { sut.on(fact, Time{}); }
  void publish(EventKind kind, const fabric::InstanceId& of) {
    EventPublished fact;
    fact.event.key = channel;
    fact.event.call = call;
    fact.event.kind = kind;
    fact.event.attempt = 1;
    fact.event.instance = of;
    fact.event.text = kind == EventKind::written ? "good" : "";
    add(fact);
  }
  void reply(fabric::ServiceCode code) {
    Replied fact;
    fact.reply.key = channel;
    fact.reply.call = call;
    fact.reply.attempt = 1;
    fact.reply.instance = instance;
    fact.reply.code = code;
    fact.reply.text = "good";
    add(fact);
  }
  /// The program is released by the response of this instance.
  void release(const fabric::InstanceId& of) {
    const gateway::Answer answer{of, 1, "good", 0};
    add(Answered{.call = call, .answer = answer});
    add(WriteDone{.key = channel,
                  .call = call,
                  .request = {},
                  .answer = answer,
                  .value = {},
                  .response = {}});
    add(Ended{.key = channel, .call = call, .answered = true});
  }

  OutcomeCheck sut;
};

TEST_F(AnOutcomeCheck, AcceptsAnAnsweredCall) {
  reply(fabric::ServiceCode::ok);
  release(instance);
  publish(EventKind::written, instance);
  EXPECT_THAT(sut.at_the_end(), IsEmpty());
}

TEST_F(AnOutcomeCheck, FindsAResponseThatAnObserverTakesForTheGateways) {
  reply(fabric::ServiceCode::ok);
  release(instance);
  publish(EventKind::written, {});
  EXPECT_THAT(sut.at_the_end(), ElementsAre(EndsWith("for settled, but it is answered")));
}

TEST_F(AnOutcomeCheck, FindsAFailureThatAnObserverDoesNotSee) {
  reply(fabric::ServiceCode::ok);
  reply(fabric::ServiceCode::failed);
  release(instance);
  EXPECT_THAT(sut.at_the_end(),
              ElementsAre(EndsWith("for under way, but it is answered or failed")));
}

TEST_F(AnOutcomeCheck, FindsAResponseThatNoInstanceHasPublished) {
  release(instance);
  publish(EventKind::written, instance);
  EXPECT_THAT(sut.at_the_end(), ElementsAre(EndsWith("for answered, but it is ")));
}

TEST_F(AnOutcomeCheck, FindsAWithdrawalThatWasNone) {
  reply(fabric::ServiceCode::ok);
  release(instance);
  publish(EventKind::withdrawn, instance);
  EXPECT_THAT(sut.at_the_end(), ElementsAre(EndsWith("for withdrawn, but it is answered")));
}

// The program has not yet taken back the request that another gateway has answered with the same.
TEST_F(AnOutcomeCheck, AcceptsACallForAnsweredWhoseRequestAnotherGatewayHasAnsweredBefore) {
  reply(fabric::ServiceCode::ok);
  release(instance);
  publish(EventKind::written, instance);
  const auto answer_again = [&](fabric::CallId later) {
    add(Claimed{.gateway = 1, .key = channel, .call = later, .request = {}});
    Replied replied;
    replied.reply.key = channel;
    replied.reply.call = later;
    replied.reply.attempt = 1;
    replied.reply.instance = instance;
    replied.reply.text = "good";
    add(replied);
    add(Answered{.call = later, .answer = {instance, 1, "good", 0}});
    EventPublished written;
    written.event.key = channel;
    written.event.call = later;
    written.event.kind = EventKind::written;
    written.event.attempt = 1;
    written.event.instance = instance;
    written.event.text = "good";
    add(written);
    add(Ended{.key = channel, .call = later, .answered = true});
  };
  answer_again({0x60, 1});
  EXPECT_THAT(sut.at_the_end(), IsEmpty());
  add(ProgramAsked{.key = channel, .request = {}});
  answer_again({0x60, 2});
  EXPECT_THAT(sut.at_the_end(), ElementsAre(EndsWith("for answered, but it is withdrawn")));
}

TEST_F(AnOutcomeCheck, DoesNotJudgeCallsOfALostJournal) {
  reply(fabric::ServiceCode::ok);
  release(instance);
  add(JournalLost{});
  EXPECT_THAT(sut.at_the_end(), IsEmpty());
}

}  // namespace
}  // namespace millrace::tests::simulation
