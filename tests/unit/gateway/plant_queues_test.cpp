// Which message queues are read, and whose calls are there.
#include "gateway/queues/plant_queues.hpp"

#include <gtest/gtest.h>

namespace millrace::gateway::queues {
namespace {

using Wanted = std::map<std::string, std::vector<QueueSettings>>;

class PlantQueuesTest : public testing::Test, QueuesIo, QueueEvents {
 protected:
  PlantQueuesTest() {
    settings.name = "ALARMS";
    settings.array = "SD.ALARMS";
    settings.control = "SD.CONTROL";
    settings.uuid = "c0ffee00-0000-4000-8000-000000000001";
    wanted["press"] = {settings};
    key = settings.key("press");
  }

  Moment now() const override { return {SteadyTime(std::chrono::hours(1)), {}}; }
  void open(const std::string&, const QueueSettings&) override { ++read; }
  void ask(const std::string&, const fabric::ChannelKey&, const Step&) override {}
  void watch(const std::string&, const fabric::ChannelKey&) override {}
  void on_queue_open(const fabric::ChannelKey&) override {
    ++opened;
    heard += "open ";
  }
  void on_queue_down(const fabric::ChannelKey&, const std::string&) override { heard += "down "; }
  void on_queue_retired(const fabric::ChannelKey&) override { ++retired; }
  void on_queue_read(const fabric::ChannelKey&, const Snapshot&) override { heard += "read "; }
  void on_queue_write(const fabric::ChannelKey&) override {}
  void on_queue_change(const fabric::ChannelKey&) override {}
  void record_of_queue(const std::vector<JournalEntry>&, const Ticket&) override {}
  void say_of_queue(const fabric::ChannelKey&, const Queue::News&) override {}
  void tell_queue(const fabric::DataSample&) override {}

  /// A journal with one message of the queue.
  [[nodiscard]] std::map<fabric::ChannelKey, QueueBook> one_waits() const {
    return {{key, one_waits_covered_by_nothing()}};
  }

  [[nodiscard]] QueueBook one_waits_covered_by_nothing() const {
    QueueBook book;
    book.apply(LastGetEntry{key, 1, 0});
    book.apply(MessageEntry{key, 1, 2, "drill worn", {}});
    return book;
  }

  QueueSettings settings;
  Wanted wanted;
  fabric::ChannelKey key;
  int read = 0;
  int opened = 0;
  int retired = 0;
  std::string heard;
  PlantQueues sut{*this, *this};
};

TEST_F(PlantQueuesTest, ReadAQueueOnceItsChannelIsOurs) {
  sut.set(wanted, {});
  sut.on_up("press", {2});
  sut.finish();
  EXPECT_EQ(read, 0);
  EXPECT_EQ(opened, 0);
  sut.on_up("press", {1});
  sut.finish();
  EXPECT_EQ(read, 1);
  EXPECT_GT(opened, 0);
}

TEST_F(PlantQueuesTest, CallMessagesOfTheJournalWithoutTheirController) {
  sut.set(wanted, one_waits());
  sut.finish();
  EXPECT_EQ(read, 0);
  EXPECT_GT(opened, 0);
}

// The session of its calls has what it asked answered before its link comes back, as a controller's
// does. A configuration that was read again in the moment of a link's end ended the gateway; found
// by the simulation, seed 1020109.
TEST_F(PlantQueuesTest, OpenAQueueAgainOnceWhatWasAskedBeforeIsAnswered) {
  sut.set(wanted, {});
  sut.on_up("press", {1});
  sut.finish();
  heard.clear();
  sut.on_down("press", "connection reset");
  sut.set(wanted, {});
  sut.read(key, ReadSet::state);
  sut.finish();
  EXPECT_EQ(heard, "down read open ");
}

TEST_F(PlantQueuesTest, TakeNoMessageForJournalledThatTheDiskDoesNotHoldYet) {
  // As where the configuration names a queue again while the disk is full.
  Queue queue("press", settings, one_waits_covered_by_nothing());
  // Its call may be under way.
  EXPECT_EQ(queue.look(ReadSet::request).request_state, 1U);
  queue.on_up(now());
  EXPECT_FALSE(queue.next(now()).has_value());
  EXPECT_TRUE(queue.take_news().wait);
  queue.on_journalled(now());
  EXPECT_TRUE(queue.next(now()).has_value());
}

TEST_F(PlantQueuesTest, GoOnWithAQueueThatTheConfigurationNamesAgainWhileItsCallIsUnderWay) {
  sut.set(wanted, one_waits());
  sut.on_up("press", {1});
  sut.finish();
  ASSERT_EQ(read, 1);
  sut.set({}, {});
  sut.finish();
  EXPECT_EQ(retired, 1);
  // The link is made anew meanwhile, and nobody reads the queue.
  sut.on_left("press", 0, "the configuration has changed");
  sut.on_up("press", {1});
  sut.finish();
  EXPECT_EQ(read, 1);
  sut.set(wanted, {});
  sut.finish();
  EXPECT_EQ(read, 2);
}

TEST_F(PlantQueuesTest, FollowAChangedConfigurationOverALinkOfItsOwn) {
  sut.set(wanted, {});
  sut.on_up("press", {1});
  sut.finish();
  wanted["press"].front().array = "SD.OTHERS";
  sut.set(wanted, {});
  sut.finish();
  EXPECT_EQ(read, 2);
  sut.set(wanted, {});
  sut.finish();
  EXPECT_EQ(read, 2);
}

}  // namespace
}  // namespace millrace::gateway::queues
