#include "gateway/machines/subscriptions.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/gateway/machines.hpp"

namespace millrace::gateway {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;
using enum Variable;

class SubscriptionsTest : public testing::Test {
 protected:
  explicit SubscriptionsTest(SubscriptionMode mode = SubscriptionMode::automatic) : sut(mode) {}

  void take(const machines::SubscriptionActions& actions) {
    for (const auto channel : actions.unsubscribe) {
      unsubscribed.push_back(channel);
    }
    for (const auto channel : actions.subscribe) {
      subscribed.push_back(channel);
    }
    for (const auto& [channel, is] : actions.trusted) {
      trusted[channel] = is;
    }
    for (const auto& look : actions.changed) {
      looks.push_back(look);
    }
    for (const auto& [level, words] : actions.log) {
      log_lines.emplace_back(level, words);
    }
  }
  void serve(const std::vector<std::uint16_t>& channels = {1}) { take(sut.serve(channels)); }
  void grant(const std::vector<std::uint16_t>& channels = {1}) {
    std::vector<machines::SubscribeOutcome> outcomes;
    for (const auto channel : channels) {
      outcomes.push_back({channel, "", false});
    }
    take(sut.on_subscribed(outcomes, now));
  }
  void refuse(std::uint16_t channel = 1) {
    take(sut.on_subscribed({{channel, "the controller refuses it: 0x701", false}}, now));
  }
  void notify(std::optional<std::uint32_t> value, std::uint16_t channel = 1) {
    take(sut.on_notification(channel, request_state, value, now));
  }
  void look(std::uint32_t value, std::uint16_t channel = 1) {
    sut.read_started(channel);
    looked(value, channel);
  }
  void looked(std::uint32_t value, std::uint16_t channel = 1) {
    ServiceSnapshot snapshot;
    snapshot.set = ReadSet::state;
    snapshot.request_state = value;
    take(sut.on_read(channel, snapshot, now));
  }
  /// REQUEST_STATE is cleared, and the next read shows it.
  void clear(std::uint16_t channel = 1) {
    sut.on_cleared(channel);
    look(0, channel);
  }
  void wait(std::chrono::milliseconds time) {
    now += time;
    take(sut.on_time(now));
  }
  /// Granted, notified and confirmed by a read: trusted.
  void be_trusted() {
    serve();
    grant();
    notify(0);
    look(0);
    ASSERT_TRUE(trusted[1]);
    looks.clear();
    log_lines.clear();
    subscribed.clear();
  }

  SteadyTime now{1h};
  machines::Subscriptions sut;
  std::vector<std::uint16_t> subscribed;
  std::vector<std::uint16_t> unsubscribed;
  std::map<std::uint16_t, bool> trusted;
  std::vector<std::pair<std::uint16_t, Variable>> looks;
  std::vector<std::pair<Level, std::string>> log_lines;
};

TEST_F(SubscriptionsTest, SubscribesEachChannelOnce) {
  serve({1, 2});
  EXPECT_THAT(subscribed, ElementsAre(1, 2));
  serve({1, 2, 3});
  EXPECT_THAT(subscribed, ElementsAre(1, 2, 3));
}

TEST_F(SubscriptionsTest, TrustsNotificationsOnceTheyMatchTheReads) {
  serve();
  grant();
  look(0);
  EXPECT_FALSE(trusted[1]);
  notify(0);
  EXPECT_TRUE(trusted[1]);
  EXPECT_EQ(sut.status().mode, fabric::WatchMode::pushed);
  EXPECT_THAT(log_lines, ElementsAre(Pair(Level::info, HasSubstr("pushed"))));
}

TEST_F(SubscriptionsTest, TheFirstValueMayComeBeforeTheResponseToTheSubscription) {
  serve();
  look(0);
  notify(0);
  EXPECT_FALSE(trusted[1]);
  grant();
  EXPECT_TRUE(trusted[1]);
}

TEST_F(SubscriptionsTest, ANotifiedChangeCausesARead) {
  be_trusted();
  notify(7);
  EXPECT_THAT(looks, ElementsAre(Pair(1, request_state)));
}

TEST_F(SubscriptionsTest, OurOwnWriteCausesNoRead) {
  be_trusted();
  notify(7);
  look(7);
  looks.clear();
  clear();
  notify(0);
  EXPECT_THAT(looks, IsEmpty());
}

// The program may have written the same request again before the controller took its next sample:
// then there is never a notification.
TEST_F(SubscriptionsTest, DoesNotTrustSilenceBetweenAWriteAndItsNotification) {
  be_trusted();
  notify(7);
  look(7);
  EXPECT_TRUE(trusted[1]);
  clear();
  EXPECT_FALSE(trusted[1]);
  notify(0);
  EXPECT_TRUE(trusted[1]);
}

TEST_F(SubscriptionsTest, TrustsAgainWhenAReadFindsTheSameRequestOnceMore) {
  be_trusted();
  notify(7);
  look(7);
  clear();
  look(7);
  EXPECT_TRUE(trusted[1]);
  for (int times = 0; times < 10; ++times) {
    clear();
    look(7);
  }
  EXPECT_EQ(sut.status().mode, fabric::WatchMode::pushed)
      << "no sample was taken in between: no notification is missing";
}

TEST_F(SubscriptionsTest, AChangeOfResponseStateCausesAReadUnlessItWasReadAlready) {
  be_trusted();
  take(sut.on_read(1, {ReadSet::states, "", "", 0, 5, ""}, now));
  take(sut.on_notification(1, response_state, 5, now));
  EXPECT_THAT(looks, IsEmpty());
  take(sut.on_notification(1, response_state, 0, now));
  EXPECT_THAT(looks, ElementsAre(Pair(1, response_state)));
}

TEST_F(SubscriptionsTest, PollsAControllerThatRefusesAndLogsThatOnce) {
  serve();
  refuse();
  EXPECT_EQ(sut.status().text, "polled: the controller refuses it: 0x701");
  ASSERT_THAT(log_lines, SizeIs(1));
  wait(10min);
  EXPECT_THAT(subscribed, SizeIs(1));
  EXPECT_THAT(log_lines, SizeIs(1));
}

TEST_F(SubscriptionsTest, SubscribesAgainOnANewLinkAndLogsNothingTwice) {
  serve();
  refuse();
  sut.link_down();
  serve();
  EXPECT_THAT(subscribed, ElementsAre(1, 1));
  refuse();
  EXPECT_THAT(log_lines, SizeIs(1));
  sut.link_down();
  serve();
  grant();
  EXPECT_THAT(log_lines, SizeIs(2));
}

TEST_F(SubscriptionsTest, NamesTheChannelThatIsPolled) {
  serve({1, 2});
  take(sut.on_subscribed({{1, "", false}, {2, "no more handles", false}}, now));
  EXPECT_EQ(sut.status().text, "pushed, except in channel 2: no more handles");
}

TEST_F(SubscriptionsTest, SubscribesAgainAfterAWhileWhereTheControllerDidNotAnswer) {
  serve();
  take(sut.on_subscribed({{1, "no answer", true}}, now));
  wait(999ms);
  EXPECT_THAT(subscribed, SizeIs(1));
  wait(1ms);
  EXPECT_THAT(subscribed, SizeIs(2));
  take(sut.on_subscribed({{1, "no answer", true}}, now));
  wait(1s);
  EXPECT_THAT(subscribed, SizeIs(2)) << "less and less often";
  wait(1s);
  EXPECT_THAT(subscribed, SizeIs(3));
}

TEST_F(SubscriptionsTest, IgnoresNotificationsOfASubscriptionThatTimedOut) {
  serve();
  notify(7);
  take(sut.on_subscribed({{1, "no answer", true}}, now));
  looks.clear();
  notify(7);
  EXPECT_THAT(looks, IsEmpty());
  look(7);
  wait(1s);
  ASSERT_THAT(subscribed, SizeIs(2));
  grant();
  EXPECT_FALSE(trusted[1]) << "the new subscription has notified nothing";
  notify(7);
  EXPECT_TRUE(trusted[1]);
}

TEST_F(SubscriptionsTest, GivesUpAControllerThatAcceptsSubscriptionsAndSendsNothing) {
  serve();
  grant();
  for (int times = 0; times < 200; ++times) {
    look(0);
    now += 10ms;
  }
  EXPECT_THAT(sut.status().text, HasSubstr("sends no notification, not even the first value"));
  EXPECT_THAT(unsubscribed, ElementsAre(1));
  EXPECT_FALSE(trusted[1]);
}

TEST_F(SubscriptionsTest, GivesUpAlsoWhileProgramsCallAllTheTime) {
  serve();
  grant();
  for (std::uint32_t times = 0; times < 200; ++times) {
    look(times % 2);
    now += 10ms;
  }
  EXPECT_THAT(sut.status().text, HasSubstr("sends no notification, not even the first value"));
}

TEST_F(SubscriptionsTest, GivesUpAControllerThatSendsNoNotificationOfALastingChange) {
  be_trusted();
  for (int times = 0; times < 200; ++times) {
    look(7);
    now += 10ms;
  }
  EXPECT_THAT(sut.status().text, HasSubstr("sent no notification of a change"));
  EXPECT_THAT(unsubscribed, ElementsAre(1));
}

TEST_F(SubscriptionsTest, AGatewayThatStoodStillDrawsNoConclusion) {
  be_trusted();
  look(7);
  now += 10s;
  look(7);
  notify(7);
  EXPECT_TRUE(trusted[1]);
}

TEST_F(SubscriptionsTest, GivesUpAControllerThatDoesNotNotifyOfThreeCalls) {
  be_trusted();
  for (int times = 0; times < 3; ++times) {
    EXPECT_EQ(sut.status().mode, fabric::WatchMode::pushed);
    now += 1s;
    look(7);
    clear();
  }
  EXPECT_THAT(sut.status().text, HasSubstr("does not send a notification for each change"));
}

// It was answered before the change, and arrives after its notification.
TEST_F(SubscriptionsTest, AReadThatANotificationOvertookProvesNothing) {
  be_trusted();
  for (std::uint32_t request = 1; request <= 20; ++request) {
    sut.read_started(1);
    notify(request);
    looked(request - 1);
    EXPECT_FALSE(trusted[1]);
    look(request);
    EXPECT_TRUE(trusted[1]);
  }
  EXPECT_EQ(sut.status().mode, fabric::WatchMode::pushed);
}

TEST_F(SubscriptionsTest, ToleratesAFaultOnceInTenMinutes) {
  be_trusted();
  for (int times = 0; times < 10; ++times) {
    now += 6min;
    look(7);
    clear();
  }
  EXPECT_EQ(sut.status().mode, fabric::WatchMode::pushed);
}

TEST_F(SubscriptionsTest, DetectsARepeatedNotification) {
  be_trusted();
  for (int times = 0; times < 3; ++times) {
    notify(7);
    look(7);
    clear();  // which is not notified
  }
  notify(7);
  EXPECT_THAT(sut.status().text, HasSubstr("does not send a notification for each change"));
}

TEST_F(SubscriptionsTest, GivesUpAControllerThatNotifiesTooLate) {
  be_trusted();
  for (int times = 0; times < 3; ++times) {
    notify(7);
    look(7);
    clear();
    now += 200ms;
    notify(0);
  }
  EXPECT_THAT(sut.status().text, HasSubstr("100 ms late"));
}

TEST_F(SubscriptionsTest, ADelayNowAndThenIsNoReason) {
  be_trusted();
  for (int times = 0; times < 20; ++times) {
    notify(7);
    look(7);
    clear();
    now += times % 3 == 0 ? 200ms : 1ms;
    notify(0);
  }
  EXPECT_EQ(sut.status().mode, fabric::WatchMode::pushed);
}

// Late notifications of an earlier subscription prove nothing about the next one.
TEST_F(SubscriptionsTest, CountsLateNotificationsFromZeroOnANewLinkAndInANewMode) {
  const auto be_late_twice = [&] {
    be_trusted();
    for (int times = 0; times < 2; ++times) {
      notify(7);
      look(7);
      clear();
      now += 200ms;
      notify(0);
    }
    EXPECT_EQ(sut.status().mode, fabric::WatchMode::pushed);
  };
  be_late_twice();
  sut.link_down();
  be_late_twice();
  take(sut.set_mode(SubscriptionMode::poll));
  take(sut.set_mode(SubscriptionMode::notify));
  be_late_twice();
}

TEST_F(SubscriptionsTest, SubscribesAgainWhereTheControllerHasDroppedAHandle) {
  be_trusted();
  notify(std::nullopt);
  EXPECT_FALSE(trusted[1]);
  EXPECT_THAT(unsubscribed, ElementsAre(1));
  EXPECT_THAT(looks, ElementsAre(Pair(1, request_state)));
  wait(1s);
  EXPECT_THAT(subscribed, ElementsAre(1));
  grant();
  notify(0);
  EXPECT_TRUE(trusted[1]);
  EXPECT_EQ(sut.status().mode, fabric::WatchMode::pushed);
}

TEST_F(SubscriptionsTest, LeavesNothingBehindInAChannelItNoLongerServes) {
  serve({1, 2});
  grant({1, 2});
  notify(0, 2);
  look(0, 2);
  looks.clear();
  serve({1});
  EXPECT_THAT(unsubscribed, ElementsAre(2));
  EXPECT_FALSE(trusted[2]);
  notify(7, 2);
  EXPECT_THAT(looks, IsEmpty());
}

TEST_F(SubscriptionsTest, FollowsANewModeWhileItRuns) {
  be_trusted();
  take(sut.set_mode(SubscriptionMode::poll));
  EXPECT_THAT(unsubscribed, ElementsAre(1));
  EXPECT_FALSE(trusted[1]);
  EXPECT_EQ(sut.status().text, "polled, as configured");
  take(sut.set_mode(SubscriptionMode::automatic));
  EXPECT_THAT(subscribed, ElementsAre(1));
}

class PollingSubscriptions : public SubscriptionsTest {
 protected:
  PollingSubscriptions() : SubscriptionsTest(SubscriptionMode::poll) {}
};

TEST_F(PollingSubscriptions, SubscribeNothingAndLogNothing) {
  serve();
  EXPECT_THAT(subscribed, IsEmpty());
  EXPECT_THAT(log_lines, IsEmpty());
  EXPECT_EQ(sut.status().text, "polled, as configured");
}

class RequiredSubscriptions : public SubscriptionsTest {
 protected:
  RequiredSubscriptions() : SubscriptionsTest(SubscriptionMode::notify) {}
};

TEST_F(RequiredSubscriptions, WarnAndSubscribeAgainAtLastOnceAMinute) {
  serve();
  refuse();
  EXPECT_THAT(log_lines, ElementsAre(Pair(Level::warn, HasSubstr("0x701"))));
  for (int minutes = 0; minutes < 10; ++minutes) {
    wait(1min);
    refuse();
  }
  const auto before = subscribed.size();
  EXPECT_GT(before, 9U);
  wait(59s);
  EXPECT_EQ(subscribed.size(), before);
  wait(1s);
  EXPECT_EQ(subscribed.size(), before + 1);
  EXPECT_THAT(log_lines, SizeIs(1));
}

TEST_F(RequiredSubscriptions, CountLateNotificationsFromZeroAfterTheyWereGivenUp) {
  be_trusted();
  for (int times = 0; times < 3; ++times) {
    notify(7);
    look(7);
    clear();
    now += 200ms;
    notify(0);
  }
  ASSERT_THAT(sut.status().text, HasSubstr("100 ms late"));
  wait(1s);
  grant();
  look(0);
  notify(0);
  ASSERT_TRUE(trusted[1]);
  notify(7);
  look(7);
  clear();
  now += 200ms;
  notify(0);
  EXPECT_EQ(sut.status().mode, fabric::WatchMode::pushed);
}

TEST_F(RequiredSubscriptions, TrustAgainAfterAWhile) {
  serve();
  grant();
  for (int times = 0; times < 200; ++times) {
    look(0);
    now += 10ms;
  }
  EXPECT_THAT(sut.status().text, HasSubstr("polled: "));
  wait(1s);
  EXPECT_THAT(subscribed, ElementsAre(1, 1));
  grant();
  notify(0);
  EXPECT_TRUE(trusted[1]);
  EXPECT_EQ(sut.status().mode, fabric::WatchMode::pushed);
}

// A machine with notifications.

class SubscribedMachine : public MachinesTest {
 protected:
  void be_trusted() {
    serve();
    sut.on_subscribed("cnc", {{1, "", false}, {2, "", false}}, time);
    for (const std::uint16_t channel : Channels{1, 2}) {
      sut.on_notification({"cnc", channel}, Variable::request_state, 0, time);
      look(channel, 0);
    }
  }
  void look(std::uint16_t channel, std::uint32_t state) {
    ServiceSnapshot snapshot;
    snapshot.set = ReadSet::state;
    snapshot.request_state = state;
    sut.on_read({"cnc", channel}, snapshot, time);
  }
};

TEST_F(SubscribedMachine, IsSubscribedForItsServedChannelsAndReportsThat) {
  be_trusted();
  EXPECT_THAT(watched, ElementsAre(ElementsAre(1, 2)));
  EXPECT_THAT(trusted, ElementsAre(Pair(1, true), Pair(2, true)));
  EXPECT_TRUE(published.connected);
  EXPECT_EQ(published.watch, fabric::WatchMode::pushed);
}

TEST_F(SubscribedMachine, ReportsAChangeButNotTheGatewaysOwnWrite) {
  be_trusted();
  changed.clear();
  sut.on_notification({"cnc", 2}, Variable::request_state, 7, time);
  EXPECT_THAT(changed, ElementsAre(2));
  look(2, 7);
  sut.write({"cnc", 2}, {Variable::request_state, Value(0U)}, time);
  EXPECT_TRUE(trusted[2]) << "no read has shown it yet";
  look(2, 0);
  EXPECT_FALSE(trusted[2]) << "until the controller has notified it";
  sut.on_notification({"cnc", 2}, Variable::request_state, 0, time);
  EXPECT_TRUE(trusted[2]);
  EXPECT_THAT(changed, ElementsAre(2));
}

TEST_F(SubscribedMachine, AWriteThatNoReadShowsHasChangedNothing) {
  be_trusted();
  sut.write({"cnc", 2}, {Variable::request_state, Value(9U)}, time);
  EXPECT_TRUE(trusted[2]);
}

TEST_F(SubscribedMachine, IsSubscribedAgainOnANewLink) {
  be_trusted();
  sut.on_link_down("cnc", {"cable"}, time);
  sut.on_link_up("cnc", {1, 2}, time);
  EXPECT_THAT(watched, ElementsAre(ElementsAre(1, 2), ElementsAre(1, 2)));
  EXPECT_THAT(unwatched, IsEmpty()) << "the controller has forgotten it";
  EXPECT_EQ(published.watch, fabric::WatchMode::polled);
}

TEST_F(SubscribedMachine, ForgetsTheChannelThatAnotherGatewayServes) {
  be_trusted();
  fabric::MachineStatus other_claim = claim(30min);
  other_claim.claims = {2};
  sut.on_machine(other_claim, time);
  EXPECT_THAT(served, ElementsAre(1));
  EXPECT_THAT(unwatched, ElementsAre(ElementsAre(2)));
  EXPECT_FALSE(trusted[2]);
  EXPECT_EQ(published.watch, fabric::WatchMode::pushed);
}

TEST_F(SubscribedMachine, FollowsANewConfigurationOnTheSameLink) {
  be_trusted();
  settings::MachineSettings machine;
  machine.name = "cnc";
  machine.watch = SubscriptionMode::poll;
  sut.set({machine}, time);
  EXPECT_TRUE(linked);
  EXPECT_THAT(unwatched, ElementsAre(ElementsAre(1, 2)));
  EXPECT_EQ(published.reason, "polled, as configured");
}

TEST_F(SubscribedMachine, IsSubscribedAgainLaterWhereItDidNotAnswer) {
  serve();
  sut.on_subscribed("cnc", {{1, "no answer", true}, {2, "", false}}, time);
  time_passes();
  EXPECT_THAT(watched, ElementsAre(ElementsAre(1, 2), ElementsAre(1)));
}

}  // namespace
}  // namespace millrace::gateway
