// Controllers that acknowledge writes and apply them later, in any order, and kernels that clear
// REQUEST_STATE themselves: each request gets one answer, its own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/gateway/desk.hpp"

namespace millrace::gateway {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using namespace std::chrono_literals;

/// A program that asks again in the cycle in which it finds its answer, and a service that repeats
/// the request in its answer.
class QuickProgram {
 public:
  QuickProgram(Desk& desk, bool changing_states) : desk_(desk), changing_states_(changing_states) {
    ask();
  }
  void run(std::chrono::milliseconds time) {
    const SteadyTime end = desk_.now.steady + time;
    while (desk_.now.steady < end) {
      if (desk_.sut->call() != nullptr && !desk_.sut->call()->answer) {
        serve();
      }
      desk_.wait(1ms);
      if (desk_.channel.values().response_state != 0) {
        answers.push_back(desk_.channel.values().response);
        ask();
      }
    }
  }
  void expect_each_answered_once() const {
    EXPECT_GT(answers.size(), 1U);
    for (std::size_t i = 0; i < answers.size(); ++i) {
      EXPECT_EQ(answers[i], std::to_string(i + 1));
    }
    EXPECT_LE(desk_.calls, answers.size() + 1);
  }
  std::vector<std::string> answers;

 private:
  void ask() {
    ++asked_;
    desk_.call(std::to_string(asked_), changing_states_ ? 1 + asked_ % 3 : 1);
  }
  void serve() {
    if (desk_.sut->call()->attempts.empty()) {
      desk_.sut->assign(desk_.assignment(), desk_.now);
      desk_.settle();
    }
    desk_.sut->on_reply(desk_.reply(desk_.sut->call()->request.text, 1), desk_.now);
    desk_.settle();
  }

  Desk& desk_;
  bool changing_states_;
  std::uint32_t asked_ = 0;
};

class LateController : public testing::TestWithParam<std::tuple<int, int, int, bool>> {};

TEST_P(LateController, GetsEachRequestAnsweredOnceWithItsOwnAnswer) {
  const auto [response, request_state, response_state, changing] = GetParam();
  Desk desk({.response_after = std::chrono::milliseconds(response),
             .request_state_after = std::chrono::milliseconds(request_state),
             .response_state_after = std::chrono::milliseconds(response_state)});
  desk.link_up();
  QuickProgram program(desk, changing);
  program.run(5s);
  program.expect_each_answered_once();
}

INSTANTIATE_TEST_SUITE_P(Delays, LateController,
                         testing::Combine(testing::Values(0, 2, 50), testing::Values(0, 5, 50),
                                          testing::Values(0, 10, 50), testing::Bool()));

class ClearingKernel : public testing::TestWithParam<std::tuple<int, int, bool, bool>> {};

TEST_P(ClearingKernel, GetsEachRequestAnsweredOnceWithItsOwnAnswer) {
  const auto [late, clears_after, changing, configured] = GetParam();
  const std::chrono::milliseconds delay(late);
  Desk desk({.response_after = delay,
             .request_state_after = delay,
             .response_state_after = delay,
             .kernel_clears_after = std::chrono::milliseconds(clears_after)});
  desk.sut->set_pace({.kernel_clears_request_state = configured});
  desk.link_up();
  QuickProgram program(desk, changing);
  program.run(10s);
  program.expect_each_answered_once();
  if (configured) {
    EXPECT_THAT(desk.writes, testing::Not(testing::Contains("REQUEST_STATE=0")));
  }
}

INSTANTIATE_TEST_SUITE_P(Delays, ClearingKernel,
                         testing::Combine(testing::Values(0, 10), testing::Values(0, 2, 50),
                                          testing::Bool(), testing::Bool()));

class Visibility : public testing::Test {
 protected:
  channel::ChannelSession& sut() { return *desk->sut; }
  void reply(const fabric::Reply& reply) {
    sut().on_reply(reply, desk->now);
    desk->settle();
  }
  std::optional<Desk> desk{std::in_place};
};

TEST_F(Visibility, AnAnswerIsJournalledAsOpenUntilARequestThatTheKernelClearsIsOver) {
  desk.emplace(tests::KernelRules{.kernel_clears_after = 1h});
  sut().set_pace({.kernel_clears_request_state = true});
  desk->dispatched_call();
  reply(desk->reply("1.414", 1));
  EXPECT_THAT(desk->writes, ElementsAre("RESPONSE=1.414", "RESPONSE_STATE=1"));
  EXPECT_EQ(sut().call(), nullptr) << "its instance is free";
  EXPECT_EQ(sut().status().state, fabric::ChannelState::answering) << "another gateway must wait";
  EXPECT_EQ(desk->ledger.open_calls().size(), 1U);
  desk->restart();
  desk->link_up();
  desk->wait(2s);
  EXPECT_EQ(desk->offers, 1U);
  EXPECT_THAT(desk->writes, ElementsAre("RESPONSE=1.414", "RESPONSE_STATE=1"));
  desk->call("3", 2);
  desk->wait(20ms);
  EXPECT_EQ(desk->offers, 2U);
  EXPECT_EQ(desk->ledger.open_calls().size(), 0U) << "the first is over, the second not given out";
}

/// The kernel clears REQUEST_STATE 30 ms after RESPONSE_STATE has taken effect, which it does 10 ms
/// late. The program gives up in between and asks the same again.
class ALateRelease : public Visibility {
 protected:
  ALateRelease() {
    desk.emplace(tests::KernelRules{.response_state_after = 10ms, .kernel_clears_after = 30ms});
    sut().set_pace({.kernel_clears_request_state = true});
    desk->dispatched_call();
    reply(desk->reply("1.414", 1));
    desk->channel.set_request_state(0);
    desk->wait(2ms);
    EXPECT_EQ(sut().status().state, fabric::ChannelState::idle);
  }
  /// The program goes on with the answer to its first request, and asks something else.
  void go_on() {
    EXPECT_EQ(desk->channel.values().response_state, 1U);
    EXPECT_EQ(desk->channel.values().request_state, 1U);
    desk->call("3", 2);
    desk->wait(20ms);
  }
};

TEST_F(ALateRelease, IsNoStateBesideANewRequest) {
  desk->wait(6ms);
  desk->call();
  desk->wait(25ms);
  EXPECT_EQ(desk->offers, 1U);
  go_on();
  EXPECT_EQ(desk->offers, 2U);
  EXPECT_EQ(sut().call()->request.text, "3");
}

TEST_F(ALateRelease, OfACallThatIsAskedAgainIsNotFollowedByItsSecondAnswer) {
  desk->call();
  desk->wait(7ms);
  ASSERT_EQ(desk->offers, 2U);
  sut().assign(desk->assignment(), desk->now);
  desk->settle();
  desk->wait(5ms);
  reply(desk->reply("1.414", 1));
  desk->wait(10ms);
  EXPECT_THAT(desk->writes, ElementsAre("RESPONSE=1.414", "RESPONSE_STATE=1"));
  go_on();
  EXPECT_EQ(desk->channel.values().response_state, 0U) << "nobody has answered \"3\"";
  EXPECT_EQ(desk->offers, 3U);
}

TEST_F(Visibility, ADrainedChannelWaitsUntilItsLastRequestIsOver) {
  desk.emplace(tests::KernelRules{.kernel_clears_after = 500ms});
  sut().set_pace({.kernel_clears_request_state = true});
  desk->dispatched_call();
  reply(desk->reply("1.414", 1));
  sut().retire(desk->now);
  desk->settle();
  EXPECT_FALSE(sut().is_over());
  desk->wait(600ms);
  EXPECT_TRUE(sut().is_over());
}

// Whoever takes the channel over would run it once more.
TEST_F(Visibility, AnAnswerOfAGatewayThatIsGoneIsNotTakenForARequestWhoseClearingIsLate) {
  desk->call();
  desk->channel.write(Variable::response_state, std::uint32_t{1});
  desk->link_up();
  desk->wait(900ms);
  EXPECT_EQ(desk->offers, 0U);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::link_down) << "not idle, that is";
  EXPECT_THAT(sut().status().reason, HasSubstr("beside a request"));
  desk->channel.write(Variable::request_state, std::uint32_t{0});
  desk->wait(200ms);
  EXPECT_EQ(desk->offers, 0U);
  EXPECT_EQ(sut().status().state, fabric::ChannelState::idle);
}

TEST_F(Visibility, ARequestBesideAnInterimStateOfAGatewayThatIsGoneIsFoundAfterASecond) {
  desk->call();
  desk->channel.write(Variable::response_state, std::uint32_t{50});
  desk->link_up();
  desk->wait(1100ms);
  EXPECT_EQ(desk->offers, 1U);
}

TEST_F(Visibility, AProgramWhoseKernelShowsAClearedRequestBeforeAnInterimStateIsNotCalledOver) {
  desk.emplace(tests::KernelRules{.response_state_after = 100ms});
  desk->dispatched_call();
  reply(desk->interim("half way", 50));
  ASSERT_THAT(desk->writes, ElementsAre("RESPONSE=half way", "RESPONSE_STATE=50"));
  desk->channel.write(Variable::request_state, std::uint32_t{0});  // as such a kernel does
  desk->wait(20ms);
  EXPECT_NE(sut().call(), nullptr);
  desk->wait(100ms);
  ASSERT_NE(sut().call(), nullptr);
  reply(desk->reply("1.414", 1));
  desk->wait(200ms);
  EXPECT_EQ(desk->channel.values().response_state, 1U);
}

// The other gateway then finds no request, and the program waited for ever. Found by the
// simulation.
TEST_F(Visibility, AChannelIsNotHandedOverWhileTheKernelMayStillClearTheRequestOfAnInterimAnswer) {
  desk->dispatched_call();
  reply(desk->interim("half way", 50));
  desk->wait(20ms);
  sut().hand_over("served by another gateway", desk->now);
  desk->settle();
  desk->wait(20ms);
  desk->channel.write(Variable::request_state, std::uint32_t{0});  // as such a kernel does
  desk->wait(20ms);
  reply(desk->reply("1.414", 1));
  desk->wait(200ms);
  EXPECT_EQ(desk->channel.values().response_state, 1U);
}

TEST_F(Visibility, AChannelIsHandedOverOnceItsRequestOutlastsAnInterimAnswer) {
  desk->dispatched_call();
  reply(desk->interim("half way", 50));
  sut().hand_over("served by another gateway", desk->now);
  desk->settle();
  desk->wait(2s);
  EXPECT_TRUE(sut().is_over());
  EXPECT_THAT(desk->withdrawn, testing::SizeIs(1));
}

// The text of the answer before is that of this one, and looks as if it were written. Found by the
// simulation.
TEST_F(Visibility, AnInterimAnswerThatIsNotVisibleIsNotForgottenWithTheConnection) {
  desk.emplace(tests::KernelRules{.response_after = 50ms, .response_state_after = 40ms});
  desk->dispatched_call();
  reply(desk->reply("1.414", 1));
  desk->wait(500ms);
  desk->call();
  desk->wait(200ms);
  ASSERT_NE(sut().call(), nullptr);
  sut().assign(desk->assignment(), desk->now);
  desk->settle();
  reply(desk->interim("half way", 50));
  reply(desk->reply("1.414", 1));
  desk->wait(30ms);
  sut().on_link_dropped("the configuration has changed", desk->now);
  desk->settle();
  desk->link_up();
  for (int i = 0; i < 2000 && desk->channel.values().response_state == 0; ++i) {
    desk->wait(1ms);
  }
  EXPECT_EQ(desk->channel.values().response_state, 1U);
  EXPECT_EQ(desk->channel.values().response, "1.414");
}

TEST_F(Visibility, AnInterimAnswerWaitsUntilTheOneBeforeIsVisible) {
  desk.emplace(tests::KernelRules{.response_state_after = 100ms});
  desk->dispatched_call();
  reply(desk->interim("half way", 50));
  reply(desk->interim("nearly there", 90));
  desk->wait(50ms);
  EXPECT_THAT(desk->writes, ElementsAre("RESPONSE=half way", "RESPONSE_STATE=50"));
  desk->wait(200ms);
  EXPECT_THAT(desk->writes, ElementsAre("RESPONSE=half way", "RESPONSE_STATE=50",
                                        "RESPONSE=nearly there", "RESPONSE_STATE=90"));
}

TEST_F(Visibility, AnInterimAnswerThatIsNotVisibleGivesWayToTheFinalOne) {
  desk.emplace(tests::KernelRules{.response_after = 50ms});
  desk->dispatched_call();
  reply(desk->interim("half way", 50));
  reply(desk->reply("1.414", 1));
  desk->wait(200ms);
  EXPECT_THAT(desk->writes, ElementsAre("RESPONSE=half way", "RESPONSE=1.414", "REQUEST_STATE=0",
                                        "RESPONSE_STATE=1"));
}

// Such a controller may show the variables of a request one after another as well.
TEST_F(Visibility, ARequestIsReadTwiceAsFarApartAsTheControllerShowsWritesLate) {
  desk.emplace(tests::KernelRules{.request_state_after = 20ms});
  desk->dispatched_call();
  reply(desk->reply("1.414", 1));
  desk->wait(100ms);
  desk->call("UUID and REQUEST of before", 2);
  desk->wait(15ms);
  desk->call("3", 2);
  desk->wait(100ms);
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->request.text, "3");
  EXPECT_EQ(desk->offers, 2U);
}

TEST_F(Visibility, WhatOneChannelHasFoundOfAControllerTheOthersNeedNotFindAgain) {
  const tests::KernelRules rules{.kernel_clears_after = 1ms};
  const auto effects = std::make_shared<WriteEffects>();
  desk.emplace(rules);
  for (const bool first : {true, false}) {
    desk->sut.emplace(fabric::ChannelKey{"cnc", 1}, *desk->context, Pace{}, effects);
    desk->dispatched_call();
    reply(desk->reply("1.414", 1));
    desk->wait(first ? 5s : 100ms);
    EXPECT_THAT(desk->writes, testing::Contains("RESPONSE_STATE=1"));
    desk->writes.clear();
  }
}

// Without the wait the 0 might come after the answer, and wipe it or the next request.
TEST_F(Visibility, AControllerThatHasShownZeroThriceIsWaitedForAlsoWhereAZeroIsLostThreeTimes) {
  desk->link_up();
  for (std::uint32_t state = 1; state <= 4; ++state) {
    desk->call("3", state);
    desk->wait(20ms);
    sut().assign(desk->assignment(), desk->now);
    desk->settle();
    if (state < 4) {
      reply(desk->reply("1.732", 1));
      desk->wait(100ms);
    }
  }
  desk->writes.clear();
  unsigned writes = 0;
  desk->fate = [&] { return Fate{WriteOutcome::written, ++writes == 1 || writes > 4}; };
  reply(desk->reply("1.732", 1));
  desk->wait(6s);
  EXPECT_THAT(desk->writes, ElementsAre("RESPONSE=1.732"));
  desk->wait(10s);
  EXPECT_THAT(desk->writes, ElementsAre("RESPONSE=1.732", "REQUEST_STATE=0", "RESPONSE_STATE=1"));
}

TEST_F(Visibility, AWriteWithoutEffectIsReportedAndLeadsToNoSecondCall) {
  desk->dispatched_call();
  unsigned writes = 0;
  desk->fate = [&] { return Fate{WriteOutcome::written, ++writes > 3}; };
  reply(desk->reply("1.414", 1));
  EXPECT_THAT(desk->writes, IsEmpty());
  desk->wait(1100ms);
  EXPECT_THAT(desk->said, testing::Contains(HasSubstr("RESPONSE and does not show it")));
  EXPECT_THAT(sut().status().reason, HasSubstr("does not show it"));
  EXPECT_THAT(desk->write_problems, ElementsAre(HasSubstr("written 2 times")));
  desk->wait(8s);
  EXPECT_THAT(desk->write_problems, testing::Contains("").Times(1)) << "it is over once";
  EXPECT_EQ(desk->write_problems.back(), "");
  EXPECT_THAT(desk->writes, ElementsAre("RESPONSE=1.414", "REQUEST_STATE=0", "RESPONSE_STATE=1"));
  EXPECT_EQ(desk->offers, 1U);
}

// The other gateway sees no request. Found by the simulation.
TEST_F(Visibility, AChannelThatIsGivenUpIsLeftOnceAReadShowsItsLastAnswer) {
  desk->dispatched_call();
  unsigned writes = 0;
  desk->fate = [&] { return Fate{WriteOutcome::written, ++writes != 3}; };
  sut().retire(desk->now);
  reply(desk->reply("1.414", 1));
  desk->wait(100ms);
  EXPECT_FALSE(sut().is_over());
  desk->wait(1100ms);
  EXPECT_TRUE(sut().is_over());
  EXPECT_EQ(desk->channel.values().response_state, 1U);
}

TEST_F(Visibility, AChannelThatIsGivenUpTakesItsProblemWithIt) {
  desk->dispatched_call();
  unsigned writes = 0;
  desk->fate = [&] { return Fate{WriteOutcome::written, ++writes < 3}; };
  reply(desk->reply("1.414", 1));
  desk->wait(4s);
  ASSERT_THAT(desk->write_problems, ElementsAre(HasSubstr("RESPONSE_STATE")));
  sut().retire(desk->now);
  desk->settle();
  EXPECT_TRUE(sut().is_over());
  EXPECT_THAT(desk->write_problems, ElementsAre(HasSubstr("RESPONSE_STATE"), ""));
}

}  // namespace
}  // namespace millrace::gateway
