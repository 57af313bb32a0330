// Which message queues are read, and the calls of which are present.
#include "gateway/core/message_queues.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/gateway/ports.hpp"

namespace millrace::gateway::core {
namespace {

using queues::MessageQueue;
using Kind = MessageQueues::ChannelEvent::Kind;
using Wanted = std::map<std::string, std::vector<queues::QueueSettings>>;

class OpenedLink final : public SilentLink {
 public:
  void open(const fabric::ChannelKey&, const queues::QueueSettings&) override { ++opened; }
  int opened = 0;
};

class MessageQueuesTest : public testing::Test {
 protected:
  MessageQueuesTest() {
    settings.name = "ALARMS";
    settings.array = "SD.ALARMS";
    settings.control = "SD.CONTROL";
    settings.uuid = "c0ffee00-0000-4000-8000-000000000001";
    wanted["press"] = {settings};
    key = settings.key("press");
  }

  void set(const Wanted& all, const std::map<fabric::ChannelKey, QueueLog>& known = {}) {
    sut.set(all, known, ports.time);
  }
  void up(const machines::Channels& channels) { sut.on_up("press", channels, link, ports.time); }
  /// The events of the core, in their order.
  std::vector<Kind> told() {
    std::vector<Kind> kinds;
    while (const auto event = sut.next_event()) {
      kinds.push_back(event->kind);
      sut.on_event_delivered(*event);
    }
    return kinds;
  }

  /// A journal with one message of the queue.
  [[nodiscard]] std::map<fabric::ChannelKey, QueueLog> one_unanswered() const {
    return {{key, one_unanswered_not_journalled()}};
  }
  [[nodiscard]] QueueLog one_unanswered_not_journalled() const {
    QueueLog queue_log;
    queue_log.apply(LastGetEntry{key, 1, 0});
    queue_log.apply(MessageEntry{key, 1, 2, "drill worn", {}});
    return queue_log;
  }

  RecordedPorts ports;
  OpenedLink link;
  queues::QueueSettings settings;
  Wanted wanted;
  fabric::ChannelKey key;
  MessageQueues sut{ports, ports};
};

TEST_F(MessageQueuesTest, AreReadOnceTheirChannelIsOwned) {
  set(wanted);
  up({2});
  EXPECT_EQ(link.opened, 0);
  EXPECT_THAT(told(), testing::Not(testing::Contains(Kind::opened)));
  up({1});
  EXPECT_EQ(link.opened, 1);
  EXPECT_THAT(told(), testing::Contains(Kind::opened));
}

TEST_F(MessageQueuesTest, CallMessagesOfTheJournalWithoutTheirController) {
  set(wanted, one_unanswered());
  EXPECT_EQ(link.opened, 0);
  EXPECT_THAT(told(), testing::Contains(Kind::opened));
}

// The pending requests of a channel are answered before its link returns, as with a real
// controller. A regression: reading the configuration again in the moment of a link's end made the
// gateway crash; found by the simulation, seed 1020109.
TEST_F(MessageQueuesTest, OpenAQueueAgainOnceEarlierRequestsAreAnswered) {
  set(wanted);
  up({1});
  told();
  sut.on_down("press", "connection reset");
  set(wanted);
  sut.read(key, ReadSet::state);
  EXPECT_THAT(told(), testing::ElementsAre(Kind::down, Kind::read, Kind::opened));
}

TEST_F(MessageQueuesTest, CountNoMessageAsJournalledThatTheDiskDoesNotHoldYet) {
  // As where the configuration names a queue again while the disk is full.
  MessageQueue queue("press", settings, one_unanswered_not_journalled());
  // Its call may be under way.
  EXPECT_EQ(queue.snapshot(ReadSet::request).request_state, 1U);
  queue.on_up(ports.time);
  EXPECT_FALSE(queue.next(ports.time).has_value());
  EXPECT_TRUE(queue.take_output().wait);
  queue.on_journalled(ports.time);
  EXPECT_TRUE(queue.next(ports.time).has_value());
}

TEST_F(MessageQueuesTest, ContinueAQueueThatTheConfigurationNamesAgainWhileItsCallIsUnderWay) {
  set(wanted, one_unanswered());
  up({1});
  told();
  ASSERT_EQ(link.opened, 1);
  set({});
  EXPECT_THAT(told(), testing::ElementsAre(Kind::draining));
  // The link is replaced, and no reader takes over the queue.
  sut.on_link_gone("press", "the configuration has changed");
  up({1});
  told();
  EXPECT_EQ(link.opened, 1);
  set(wanted);
  EXPECT_EQ(link.opened, 2);
}

TEST_F(MessageQueuesTest, FollowAChangedConfigurationAfterBeingReopened) {
  set(wanted);
  up({1});
  wanted["press"].front().array = "SD.OTHERS";
  set(wanted);
  EXPECT_EQ(link.opened, 2);
  set(wanted);
  EXPECT_EQ(link.opened, 2);
}

TEST_F(MessageQueuesTest, ReadNothingOverALinkThatIsGone) {
  set(wanted);
  up({1});
  sut.on_link_gone("press", "removed from the configuration");
  sut.on_answer(key, queues::Answer<queues::Control>{}, ports.time);
  ports.time.steady += std::chrono::seconds(10);
  sut.on_time(ports.time);
  EXPECT_EQ(sut.next_time(), std::nullopt);
}

}  // namespace
}  // namespace millrace::gateway::core
