// A message queue from the controller's ring to the service and back to LastGet.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/core/message_queues.hpp"
#include "tests/unit/gateway/ports.hpp"
#include "tests/unit/gateway/queue_fixture.hpp"

namespace millrace::gateway {
namespace {

using queues::Acknowledge;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TEST(MessageQueueReader, ReportsThatAProgramHasInitialisedTheQueue) {
  QueueFixture sut(4);
  sut.serve();
  ASSERT_TRUE(sut.settle());
  ASSERT_TRUE(sut.ring.write("1"));
  ASSERT_TRUE(sut.settle());
  sut.ring.initialise();
  ASSERT_TRUE(sut.settle());
  EXPECT_THAT(sut.log_lines, Contains(HasSubstr("LastGet is 1, not 2 as this gateway wrote it")));
}

TEST(MessageQueueReader, ContinuesWhereASecondReaderHasLeftLastGet) {
  QueueFixture sut(5);
  sut.serve();
  ASSERT_TRUE(sut.settle());
  sut.ring.write("1");
  sut.ring.write("2");
  sut.ring.last_get = 3;  // another reader has read both
  sut.ring.write("3");
  ASSERT_TRUE(sut.settle());
  EXPECT_THAT(texts_of(sut), ElementsAre("3"));
  EXPECT_THAT(sut.log_lines, Contains(HasSubstr("another reader uses it")));
  EXPECT_EQ(sut.ring.last_get, 4);
}

TEST(MessageQueueReader, LosesNothingBetweenTwoReaders) {
  // The other reader reads at any time, and sets LastGet; each message is read by at least one of
  // both.
  for (int at = 0; at < 60; ++at) {
    QueueFixture sut(4);
    std::vector<std::string> of_other_reader;
    run_with(sut, at, 9, [&](int) {
      const auto control = sut.ring.control();
      for (const auto element : queues::elements_after(control, sut.ring.last_get)) {
        of_other_reader.push_back(sut.ring.texts[element - 1]);
      }
      sut.ring.last_get = sut.ring.last_filled;
    });
    const auto of_gateway = texts_of(sut);
    for (const std::string& number : numbers(1, 9)) {
      ASSERT_TRUE(
          std::ranges::count(of_gateway, number) + std::ranges::count(of_other_reader, number) >= 1)
          << number << " with the other reader in step " << at;
      ASSERT_LE(std::ranges::count(of_gateway, number), 1) << number;
    }
  }
}

TEST(MessageQueueReader, WritesNothingWhereTheControlStructureCannotBe) {
  QueueFixture sut(3);
  sut.serve();
  ASSERT_TRUE(sut.settle());
  sut.ring.last_filled = 0;
  sut.ring.last_get = 9;
  ASSERT_TRUE(sut.settle());
  EXPECT_EQ(sut.ring.last_get, 9);
  EXPECT_THAT(sut.troubles,
              ElementsAre(HasSubstr("press.alarms/1: SD.ALARMS has LastFilled 0 and LastGet 9")));
  sut.ring.initialise();
  sut.ring.write("1");
  ASSERT_TRUE(sut.settle());
  EXPECT_THAT(texts_of(sut), ElementsAre("1"));
  EXPECT_EQ(sut.troubles.back(), "");
}

TEST(MessageQueueReader, TriesAgainWhatTheControllerRefuses) {
  QueueFixture sut(3);
  sut.serve();
  ASSERT_TRUE(sut.settle());
  sut.refuses = true;
  sut.ring.write("1");
  ASSERT_TRUE(sut.settle());
  EXPECT_THAT(texts_of(sut), IsEmpty());
  EXPECT_THAT(sut.troubles, SizeIs(1));
  sut.refuses = false;
  ASSERT_TRUE(sut.settle());
  EXPECT_THAT(texts_of(sut), ElementsAre("1"));
  EXPECT_EQ(sut.ring.last_get, 2);
}

TEST(MessageQueueReader, ReadsAnUnservedQueueIntoTheJournal) {
  QueueFixture sut(3);
  ASSERT_TRUE(sut.settle());
  for (int i = 1; i <= 20; ++i) {
    ASSERT_TRUE(sut.ring.write(std::to_string(i))) << "full at " << i;
    ASSERT_TRUE(sut.settle());
  }
  EXPECT_EQ(sut.waiting(), 20);
  sut.crash();
  sut.serve();
  ASSERT_TRUE(sut.settle());
  EXPECT_EQ(texts_of(sut), numbers(1, 20));
}

TEST(MessageQueueReader, LeavesThemInTheQueueUntilTheyAreAnsweredAndWarnsBeforeItIsFull) {
  QueueFixture sut(5, Acknowledge::when_answered);
  ASSERT_TRUE(sut.settle());
  for (int i = 1; i <= 3; ++i) {
    ASSERT_TRUE(sut.ring.write(std::to_string(i)));
  }
  ASSERT_TRUE(sut.settle());
  EXPECT_EQ(sut.ring.last_get, 1);
  EXPECT_FALSE(sut.ring.full());
  EXPECT_THAT(sut.filling, ElementsAre(HasSubstr("3 of 4 messages")));
  sut.serve();
  ASSERT_TRUE(sut.settle());
  EXPECT_EQ(texts_of(sut), numbers(1, 3));
  EXPECT_EQ(sut.ring.last_get, 4);
  EXPECT_EQ(sut.filling.back(), "");
}

TEST(MessageQueueReader, WarnsBeforeTheSmallestQueueIsFull) {
  QueueFixture sut(3, Acknowledge::when_answered);
  ASSERT_TRUE(sut.settle());
  ASSERT_TRUE(sut.ring.write("1"));
  ASSERT_TRUE(sut.settle());
  EXPECT_FALSE(sut.ring.full());
  EXPECT_THAT(sut.filling, ElementsAre(HasSubstr("1 of 2 messages")));
}

TEST(MessageQueueReader, WarnsBeforeAsManyWaitAsMayAndLeavesMoreInTheQueue) {
  QueueFixture sut(5);
  sut.settings.backlog = 8;
  sut.start();
  ASSERT_TRUE(sut.settle());
  int written = 0;
  while (sut.ring.write(std::to_string(written + 1))) {
    ++written;
    ASSERT_TRUE(sut.settle());
    if (written == 6) {
      EXPECT_THAT(sut.filling, ElementsAre(HasSubstr("6 of 8 messages that the journal may hold")));
    }
  }
  EXPECT_EQ(written, 8 + 4);
  EXPECT_EQ(sut.waiting(), 8);
  sut.serve();
  ASSERT_TRUE(sut.settle());
  EXPECT_EQ(texts_of(sut), numbers(1, written));
}

TEST(MessageQueueReader, ReadsNoMoreAtOnceThanMayWait) {
  QueueFixture sut(12);
  sut.settings.backlog = 4;
  sut.start();
  for (int number = 1; number <= 10; ++number) {
    ASSERT_TRUE(sut.ring.write(std::to_string(number)));
  }
  ASSERT_TRUE(sut.settle());
  EXPECT_EQ(sut.waiting(), 4);
}

TEST(MessageQueueReader, ReportsThatThereIsRoomAgainAlsoWhileTheControllerDoesNotAnswer) {
  QueueFixture sut(5);
  sut.settings.backlog = 4;
  sut.start();
  for (int number = 1; number <= 3; ++number) {
    ASSERT_TRUE(sut.ring.write(std::to_string(number)));
  }
  ASSERT_TRUE(sut.settle());
  ASSERT_THAT(sut.filling, ElementsAre(HasSubstr("3 of 4 messages that the journal may hold")));
  sut.switch_controller_off();
  sut.serve();
  ASSERT_TRUE(sut.settle());
  EXPECT_EQ(texts_of(sut), numbers(1, 3));
  EXPECT_THAT(sut.filling, ElementsAre(HasSubstr("3 of 4"), ""));
}

TEST(MessageQueueReader, ReadsAtOnceWhenNotifiedAndAcceptsLateNotifications) {
  QueueFixture sut(4);
  sut.serve();
  ASSERT_TRUE(sut.settle());
  ASSERT_TRUE(sut.ring.write("1"));
  sut.tell();
  for (int i = 0; i < 200 && sut.step(); ++i) {
    sut.tell();
  }
  EXPECT_THAT(texts_of(sut), ElementsAre("1"));
}

TEST(MessageQueueReader, ReadsAgainAfterANotificationDuringARead) {
  const Moment now{SteadyTime(std::chrono::hours(1)), {}};
  queues::QueueReader sut(std::chrono::minutes(1));
  QueueLog queue_log;
  queue_log.apply(LastGetEntry{{"press.alarms", 1}, 1, 0});
  sut.on_up(now);
  ASSERT_EQ(sut.next(queue_log, 0, now), std::optional<queues::Step>(queues::ReadControl{}));
  // The controller's response is older than the message.
  sut.on_event(now);
  sut.on_control(queues::Control{1, 1, 3}, queue_log, 10, now);
  EXPECT_EQ(sut.next(queue_log, 0, now), std::optional<queues::Step>(queues::ReadControl{}));
  sut.on_control(queues::Control{1, 1, 3}, queue_log, 10, now);
  EXPECT_EQ(sut.next(queue_log, 0, now), std::nullopt);
}

TEST(MessageQueueReader, HasItsCallsBesideThoseOfItsChannel) {
  QueueFixture sut(3);
  EXPECT_EQ(sut.key.to_string(), "press.alarms/1");
  sut.serve();
  ASSERT_TRUE(sut.settle());
  sut.ring.write("1");
  ASSERT_TRUE(sut.settle());
  // The journal holds the queue and no call.
  EXPECT_THAT(sut.journal_state.open_calls(), IsEmpty());
  EXPECT_EQ(sut.journal_state.queues().at(sut.key).waiting(), 0);
}

/// A queue whose journal confirms on demand.
class AQueueWithASlowJournal : public testing::Test {
 protected:
  AQueueWithASlowJournal() { sut.on_up(now); }

  static queues::QueueSettings settings() {
    queues::QueueSettings queue;
    queue.name = "alarms";
    queue.array = "SD.ALARMS";
    queue.control = "SD.CONTROL";
    queue.uuid = QueueFixture::uuid;
    return queue;
  }
  /// The controller answers all requests for two seconds.
  void work() {
    for (const SteadyTime end = now.steady + std::chrono::seconds(2); now.steady < end;) {
      const auto step = sut.next(now);
      if (!step) {
        now.steady += std::chrono::milliseconds(100);
      } else if (std::holds_alternative<queues::ReadControl>(*step)) {
        sut.on_control(ring.control(), now);
      } else if (std::holds_alternative<queues::ReadQueue>(*step)) {
        sut.on_array(ring.texts, now);
      } else {
        ring.last_get = std::get<queues::WriteLastGet>(*step).element;
        sut.on_written({}, now);
      }
      sut.take_output();  // in the journal from now on, which is slow
    }
  }
  [[nodiscard]] std::string shown() const { return sut.snapshot(ReadSet::request).request; }

  RingModel ring{5};
  Moment now{SteadyTime(std::chrono::hours(1)), {}};
  queues::MessageQueue sut{"press", settings(), {}};
};

TEST_F(AQueueWithASlowJournal, LeavesAMessageInTheControllerUntilItIsJournalledAlsoOnANewLink) {
  ring.write("first");
  work();
  sut.on_down("cable");
  sut.on_up(now);
  work();
  EXPECT_EQ(ring.last_get, 1U);
  EXPECT_EQ(shown(), "");
  sut.on_journalled(now);
  EXPECT_EQ(shown(), "first");
  work();
  EXPECT_EQ(ring.last_get, 2U);
}

TEST_F(AQueueWithASlowJournal, CountsNoMessageAsJournalledThatWasReadOverANewLinkSince) {
  ring.write("first");
  work();
  sut.on_down("cable");
  sut.on_up(now);
  ring.write("second");
  work();
  sut.on_journalled(now);
  work();
  EXPECT_EQ(ring.last_get, 2U);
  sut.on_journalled(now);
  work();
  EXPECT_EQ(ring.last_get, 3U);
}

TEST_F(AQueueWithASlowJournal, CallsTheNextMessageOnceItIsJournalled) {
  ring.write("first");
  work();
  sut.on_journalled(now);
  ring.write("second");
  work();
  sut.write({Variable::response, std::string("done")}, now);
  sut.write({Variable::request_state, std::uint32_t{0}}, now);
  sut.write({Variable::response_state, std::uint32_t{1}, true}, now);
  sut.on_acknowledged();
  EXPECT_EQ(shown(), "");
  sut.on_journalled(now);
  EXPECT_EQ(shown(), "second");
}

TEST_F(AQueueWithASlowJournal, EndsAMessageWhoseAnswerIsWrittenWhileTheConfigurationChanges) {
  ring.write("one");
  work();
  sut.on_journalled(now);
  sut.write({Variable::response, "ok"}, now);
  sut.write({Variable::request_state, 0U}, now);
  auto changed = settings();
  changed.backlog = 5;
  changed.uuid = "another";
  sut.change(changed);
  EXPECT_EQ(sut.snapshot(ReadSet::all).uuid, QueueFixture::uuid);
  EXPECT_EQ(sut.snapshot(ReadSet::all).response, "ok");
  sut.write({Variable::response_state, 1U, true}, now);
  EXPECT_EQ(sut.view().answered, 1U);
}

TEST_F(AQueueWithASlowJournal, PassesAWaitingMessageToTheServiceThatTheConfigurationNamesNow) {
  ring.write("one");
  work();
  sut.on_journalled(now);
  auto changed = settings();
  changed.uuid = "another";
  sut.change(changed);
  EXPECT_TRUE(sut.take_output().shows);
  EXPECT_EQ(sut.snapshot(ReadSet::request).uuid, "another");
}

// Values next to the request of a message would be taken for an answer to it.
TEST(AQueueServiceInterface, ShowsNothingOfTheResponseBeforeBesideTheNextMessage) {
  queues::QueueServiceInterface sut("560aacbf-6335-44a9-895a-8b27f3ed5e47");
  sut.show({.number = 1, .element = 2, .text = "first"});
  sut.write({Variable::response, std::string("done")});
  sut.write({Variable::request_state, std::uint32_t{0}});
  ASSERT_TRUE(sut.write({Variable::response_state, std::uint32_t{1}, true}));
  sut.show({.number = 2, .element = 3, .text = "second"});
  const ServiceSnapshot next = sut.snapshot(ReadSet::all);
  EXPECT_EQ(next.request, "second");
  EXPECT_EQ(next.response, "");
  EXPECT_EQ(next.response_state, 0U);
}

// Where programs wait for RESPONSE alone, the answer is written in a different order.
TEST(AQueueServiceInterface, HasItsAnswerWithTheWriteThatReleasesAProgramWhicheverThatIs) {
  queues::QueueServiceInterface sut("560aacbf-6335-44a9-895a-8b27f3ed5e47");
  sut.show({.number = 1, .element = 2, .text = "first"});
  EXPECT_FALSE(sut.write({Variable::request_state, 0U}));
  EXPECT_FALSE(sut.write({Variable::response_state, 99U}));
  EXPECT_TRUE(sut.write({Variable::response, "done", true}));
  EXPECT_EQ(sut.response(), "done");
  EXPECT_EQ(sut.response_state(), 99U);
}

TEST(AQueueServiceInterface, IgnoresAWriteThatWasUnderWayWhenItsMessageGotAnotherUuid) {
  queues::QueueServiceInterface sut("560aacbf-6335-44a9-895a-8b27f3ed5e47");
  sut.show({.number = 1, .element = 2, .text = "first"});
  sut.set_uuid("another");
  EXPECT_FALSE(sut.write({Variable::request_state, 0U}));
  EXPECT_EQ(sut.snapshot(ReadSet::all).request_state, 1U);
  sut.on_read(ReadSet::state);
  EXPECT_FALSE(sut.write({Variable::response_state, 1U, true}));
  sut.on_read(ReadSet::all);
  EXPECT_FALSE(sut.write({Variable::request_state, 0U}));
  EXPECT_EQ(sut.snapshot(ReadSet::all).request_state, 0U);
}

TEST(QueueLog, IsTheSameAfterItsSnapshot) {
  const fabric::ChannelKey key{"press.alarms", 1};
  QueueLog queue_log;
  queue_log.apply(LastGetEntry{key, 1, 0});
  queue_log.apply(MessageEntry{key, 1, 2, "a"});
  queue_log.apply(MessageEntry{key, 2, 3, "b"});
  queue_log.apply(MessageEndedEntry{key, 1});
  journal::JournalState sut;
  for (const JournalEntry& entry : queue_log.snapshot(key)) {
    sut.apply(entry);
  }
  EXPECT_EQ(sut.queues().at(key), queue_log);
  EXPECT_EQ(queue_log.read_up_to(), 3);
  EXPECT_EQ(queue_log.next()->text, "b");
}

TEST(QueueLog, EndsTheCallOfAMessageWithTheMessage) {
  const fabric::ChannelKey key{"press.alarms", 1};
  journal::JournalState sut;
  sut.apply(MessageEntry{key, 5, 2, "a"});
  DispatchedEntry call;
  call.call = {1, 2};
  call.key = key;
  call.request = {"u", "a", request_state_of(5)};
  sut.apply(call);
  ASSERT_THAT(sut.open_calls(), SizeIs(1));
  sut.apply(MessageEndedEntry{key, 5});
  EXPECT_THAT(sut.open_calls(), IsEmpty());
}

TEST(Ring, NamesTheElementsBehindLastGetOverTheEnd) {
  using queues::elements_after;
  EXPECT_THAT(elements_after({3, 1, 3}, 1), ElementsAre(2, 3));
  EXPECT_THAT(elements_after({1, 2, 3}, 2), ElementsAre(3, 1));
  EXPECT_THAT(elements_after({2, 2, 3}, 2), IsEmpty());
  EXPECT_TRUE(queues::holds({1, 2, 3}, 1));
  EXPECT_FALSE(queues::holds({3, 2, 3}, 1));
  EXPECT_THAT(queues::wrong_with({1, 1, 2}), HasSubstr("2 elements"));
}

}  // namespace
}  // namespace millrace::gateway

namespace millrace::gateway::core {
namespace {

using queues::MessageQueue;
using Kind = MessageQueues::ChannelEvent::Kind;
using Wanted = std::vector<settings::MachineSettings>;

// Which message queues are read, and the calls of which are present.
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
    wanted = {{.name = "press", .queues = {settings}}};
    key = settings.key("press");
  }

  void set(const Wanted& all, const std::map<fabric::ChannelKey, QueueLog>& known = {}) {
    sut.set(all, known, ports.time);
  }
  void up(const machines::Channels& channels) { sut.on_up("press", channels, link, ports.time); }
  /// The events of the core, in their order.
  std::vector<Kind> take_events() {
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
  EXPECT_THAT(take_events(), testing::Not(testing::Contains(Kind::opened)));
  up({1});
  EXPECT_EQ(link.opened, 1);
  EXPECT_THAT(take_events(), testing::Contains(Kind::opened));
}

TEST_F(MessageQueuesTest, CallMessagesOfTheJournalWithoutTheirController) {
  set(wanted, one_unanswered());
  EXPECT_EQ(link.opened, 0);
  EXPECT_THAT(take_events(), testing::Contains(Kind::opened));
}

// The pending requests of a channel are answered before its link returns, as with a real
// controller. A regression: reading the configuration again in the moment of a link's end made the
// gateway crash; found by the simulation, seed 1020109.
TEST_F(MessageQueuesTest, OpenAQueueAgainOnceEarlierRequestsAreAnswered) {
  set(wanted);
  up({1});
  take_events();
  sut.on_down("press", "connection reset");
  set(wanted);
  sut.read(key, ReadSet::state);
  EXPECT_THAT(take_events(), testing::ElementsAre(Kind::down, Kind::read, Kind::opened));
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
  take_events();
  ASSERT_EQ(link.opened, 1);
  set({});
  EXPECT_THAT(take_events(), testing::ElementsAre(Kind::draining));
  // The link is replaced, and no reader takes over the queue.
  sut.on_link_gone("press", "the configuration has changed");
  up({1});
  take_events();
  EXPECT_EQ(link.opened, 1);
  set(wanted);
  EXPECT_EQ(link.opened, 2);
}

TEST_F(MessageQueuesTest, FollowAChangedConfigurationAfterBeingReopened) {
  set(wanted);
  up({1});
  wanted.front().queues.front().array = "SD.OTHERS";
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
