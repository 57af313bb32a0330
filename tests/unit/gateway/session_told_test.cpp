// How a channel session looks while its controller tells of changes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/gateway/desk.hpp"

namespace millrace::gateway {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;

class ToldChannel : public testing::Test {
 protected:
  void be_told() {
    desk.link_up();
    desk.wait(1s);
    sut().set_told(true, desk.now);
    desk.settle();
    // What was due before.
    desk.wait(500ms);
    desk.reads = 0;
  }
  void change(Variable variable = Variable::request_state) {
    sut().on_change(variable, desk.now);
    desk.settle();
  }
  channel::ChannelSession& sut() { return *desk.sut; }
  Desk desk;
};

TEST_F(ToldChannel, IsLookedAtTwiceASecond) {
  be_told();
  desk.wait(10s);
  EXPECT_EQ(desk.reads, 20U);
}

TEST_F(ToldChannel, IsLookedAtAtOnceWhenSomethingHasChanged) {
  be_told();
  desk.call();
  change();
  EXPECT_EQ(desk.offers, 1U);
  EXPECT_EQ(desk.reads, 2U) << "the request, and the same once more";
}

TEST_F(ToldChannel, IsAcceptedByTheSameRulesAsEver) {
  be_told();
  desk.call("old", 1);
  int actions = 0;
  desk.before_action = [&] {
    if (++actions == 2) {
      desk.call("new", 2);
    }
  };
  change();
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->request.text, "new");
  EXPECT_EQ(desk.reads, 3U) << "what read differently is read once more";
}

TEST_F(ToldChannel, IsNotAcceptedWhileItsTextsAreWritten) {
  be_told();
  desk.call("old", 1);
  int actions = 0;
  desk.before_action = [&] {
    if (++actions == 2) {
      desk.call("half", 1);
    } else if (actions == 3) {
      desk.call("whole", 1);
    }
  };
  change();
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->request.text, "whole");
}

TEST_F(ToldChannel, IsFoundWithoutAWordAtTheNextLookForSafety) {
  be_told();
  desk.call();
  desk.wait(500ms);
  EXPECT_EQ(desk.offers, 1U);
}

TEST_F(ToldChannel, IsLookedAtOnceMoreWhenItChangesDuringALook) {
  be_told();
  bool first = true;
  desk.before_action = [&] {
    if (std::exchange(first, false)) {
      // The look has been sent; the program writes behind it.
      static_cast<void>(sut().on_change(Variable::request_state, desk.now));
    }
  };
  change();
  EXPECT_EQ(desk.reads, 2U);
}

TEST_F(ToldChannel, IsPolledAgainAtOnceWhenNothingIsToldAnyMore) {
  be_told();
  sut().set_told(false, desk.now);
  desk.settle();
  desk.call();
  desk.wait(11ms);
  EXPECT_EQ(desk.offers, 1U);
}

TEST_F(ToldChannel, IsPolledOnANewLinkUntilItIsToldAgain) {
  be_told();
  sut().on_link_down("cable", desk.now);
  desk.settle();
  desk.link_up();
  desk.wait(1s);
  EXPECT_GE(desk.reads, 100U);
}

TEST_F(ToldChannel, LearnsAtOnceThatAProgramHasWithdrawnItsCall) {
  be_told();
  desk.call();
  change();
  sut().assign(desk.assignment(), desk.now);
  desk.settle();
  desk.reads = 0;
  desk.wait(400ms);
  EXPECT_LE(desk.reads, 1U) << "a call that runs is not polled";
  desk.channel.set_request_state(0);
  change();
  EXPECT_EQ(sut().call(), nullptr);
  EXPECT_THAT(desk.withdrawn, ElementsAre(instance(1)));
}

TEST_F(ToldChannel, ResponseStateIsOfInterestAfterAnInterimAnswerOnly) {
  be_told();
  change(Variable::response_state);
  EXPECT_EQ(desk.reads, 0U);
  desk.call();
  change();
  sut().assign(desk.assignment(), desk.now);
  desk.settle();
  desk.reads = 0;
  change(Variable::response_state);
  EXPECT_EQ(desk.reads, 0U);
  sut().on_reply(desk.interim("half", 5), desk.now);
  desk.settle();
  desk.reads = 0;
  change(Variable::response_state);
  EXPECT_EQ(desk.reads, 1U);
}

TEST_F(ToldChannel, IsAnsweredAsEver) {
  be_told();
  desk.call();
  change();
  sut().assign(desk.assignment(), desk.now);
  desk.settle();
  sut().on_reply(desk.reply("4", 3), desk.now);
  desk.settle();
  EXPECT_THAT(desk.writes, ElementsAre("RESPONSE=4", "REQUEST_STATE=0", "RESPONSE_STATE=3"));
}

}  // namespace
}  // namespace millrace::gateway
