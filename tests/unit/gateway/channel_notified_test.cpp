// How a channel is read while its controller sends notifications.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/gateway/channel_fixture.hpp"

namespace millrace::gateway {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;

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

TEST_F(NotifiedChannel, IsNotAcceptedWhileItsTextsAreWritten) {
  start_notifications();
  fixture.call("old", 1);
  int actions = 0;
  fixture.before_action = [&] {
    if (++actions == 2) {
      fixture.call("half", 1);
    } else if (actions == 3) {
      fixture.call("whole", 1);
    }
  };
  change();
  ASSERT_NE(sut().call(), nullptr);
  EXPECT_EQ(sut().call()->request.text, "whole");
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
  sut().on_link_down("cable", fixture.now);
  fixture.settle();
  fixture.link_up();
  fixture.wait(1s);
  EXPECT_GE(fixture.reads, 100U);
}

TEST_F(NotifiedChannel, DetectsAtOnceThatAProgramHasWithdrawnItsCall) {
  start_notifications();
  fixture.call();
  change();
  sut().assign(fixture.assignment(), fixture.now);
  fixture.settle();
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
  sut().assign(fixture.assignment(), fixture.now);
  fixture.settle();
  fixture.reads = 0;
  change(Variable::response_state);
  EXPECT_EQ(fixture.reads, 0U);
  sut().on_reply(fixture.interim("half", 5), fixture.now);
  fixture.settle();
  fixture.reads = 0;
  change(Variable::response_state);
  EXPECT_EQ(fixture.reads, 1U);
}

TEST_F(NotifiedChannel, IsAnsweredAsUsual) {
  start_notifications();
  fixture.call();
  change();
  sut().assign(fixture.assignment(), fixture.now);
  fixture.settle();
  sut().on_reply(fixture.reply("4", 3), fixture.now);
  fixture.settle();
  EXPECT_THAT(fixture.writes, ElementsAre("RESPONSE=4", "REQUEST_STATE=0", "RESPONSE_STATE=3"));
}

}  // namespace
}  // namespace millrace::gateway
