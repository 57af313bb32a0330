// The core between its ports: the beginning and the end of each input. Its decisions have other
// tests (core_calls_test, core_channels_test, machines_test, message_queues_test).
#include "gateway/core/core.hpp"

#include <functional>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/core/channel_table.hpp"
#include "gateway/machines/stall_detector.hpp"
#include "tests/unit/gateway/core_calls_test.hpp"
#include "tests/unit/gateway/ports.hpp"

namespace millrace::gateway::core {
namespace {

using testing::Contains;
using testing::HasSubstr;
using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr auto lease = 2s;

/// Counts the requests about queues, and answers nothing.
class CountedLink final : public SilentLink {
 public:
  CountedLink(int& links, int& asked) : links_(links), asked_(asked) { ++links_; }
  ~CountedLink() override { --links_; }
  CountedLink(const CountedLink&) = delete;
  CountedLink& operator=(const CountedLink&) = delete;
  using SilentLink::ask;
  void ask(const fabric::ChannelKey&, const queues::Step&) override { ++asked_; }

 private:
  int& links_;
  int& asked_;
};

class CoreTest : public testing::Test, public RecordedPorts {
 protected:
  CoreTest() {
    journal_state.apply(NumbersEntry{own_epoch, 1000});
    settings::MachineSettings machine;
    machine.name = "cnc";
    sut = std::make_unique<Core>(*this, *this,
                                 CoreOptions{.own = {gateway_id(5), "host1", 4711, "1", own_epoch},
                                             .lease = lease,
                                             .machines = {machine}},
                                 journal_state);
    sut->start();
  }

  std::unique_ptr<machines::Controller> connect(const settings::MachineSettings&) override {
    return std::make_unique<CountedLink>(links, queue_asked);
  }

  void time_comes() {
    ASSERT_TRUE(wakes_at);
    time.steady = std::max(time.steady, *wakes_at);
    sut->on_time();
  }
  void serve() {
    time_comes();
    sut->on_link_up("cnc", {1, 2});
  }
  void look(std::uint32_t request_state, ReadSet set) {
    ServiceSnapshot snapshot;
    snapshot.set = set;
    snapshot.uuid = service.uuid;
    snapshot.request_state = request_state;
    sut->on_read({"cnc", 1}, snapshot);
  }

  void journal_confirms() {
    for (const Ticket& ticket : std::exchange(tickets, {})) {
      sut->on_recorded(ticket);
    }
  }
  void program_asks() {
    look(0, ReadSet::state);
    for (const ReadSet set : {ReadSet::state, ReadSet::texts, ReadSet::request}) {
      look(1, set);
    }
  }
  void instance_answers() { sut->on_reply(reply_to(given, "ok", 1)); }

  const fabric::InstanceIdentity service{.id = gateway_id(7),
                                         .uuid = "b0ad2ab8-5e5c-4c8c-9b0b-0f6f0a1c2d3e"};
  journal::JournalState journal_state;
  int links = 0;
  int queue_asked = 0;
  std::unique_ptr<Core> sut;
};

TEST_F(CoreTest, ConnectsOnceItHasListened) {
  EXPECT_EQ(links, 0);
  serve();
  EXPECT_EQ(links, 1);
  EXPECT_TRUE(sut->serves({"cnc", 1}));
  EXPECT_TRUE(sut->serves({"cnc", 2}));
}

TEST_F(CoreTest, SetsItsTimerForWhatIsDueNext) {
  ASSERT_TRUE(wakes_at);
  EXPECT_GT(*wakes_at, time.steady);
  const auto listens_until = *wakes_at;
  sut->on_time();
  EXPECT_EQ(links, 0) << "earlier is harmless";
  EXPECT_EQ(wakes_at, listens_until);
}

TEST_F(CoreTest, SetsItsTimerForAMessageQueueWhereNothingElseHappens) {
  serve();
  settings::MachineSettings machine;
  machine.name = "cnc";
  machine.queues = {{.name = "ALARMS", .array = "SD.ALARMS", .control = "SD.CONTROL"}};
  sut->change({machine}, {});
  const queues::QueueSettings& queue = machine.queues.front();
  // The first read only finds the position where earlier readers stopped.
  for (int look = 1; look <= 2; ++look) {
    ASSERT_EQ(queue_asked, look);
    sut->on_queue_answer(queue.key("cnc"),
                         queues::Answer<queues::Control>(queues::Control{1, 1, 4}));
  }
  const SteadyTime due = time.steady + queue.period;
  for (int times = 0; times < 1000 && queue_asked < 3; ++times) {
    time_comes();
  }
  EXPECT_EQ(queue_asked, 3);
  EXPECT_EQ(time.steady, due);
}

TEST_F(CoreTest, MayEndAtOnceWhereNoAnswerIsHalfWritten) {
  serve();
  sut->stop();
  EXPECT_EQ(ended, false);
}

TEST_F(CoreTest, MayEndAfterTwoSecondsWhereAnAnswerIsHalfWritten) {
  serve();
  journal_confirms();
  sut->on_instance_ready(service);
  program_asks();
  journal_confirms();
  instance_answers();
  journal_confirms();
  ASSERT_EQ(channel.state, fabric::ChannelState::answering);
  sut->stop();
  time.steady += 1999ms;
  sut->on_time();
  EXPECT_EQ(ended, std::nullopt);
  time.steady += 1ms;
  sut->on_time();
  EXPECT_EQ(ended, true);
}

// A regression: the journal became writable while the gateway was ending, and it accepted calls
// again.
TEST_F(CoreTest, AcceptsNothingWhileItEndsAlsoWhenTheJournalCanBeWrittenAgain) {
  serve();
  sut->on_instance_ready(service);
  sut->on_journal_error("No space left on device");
  EXPECT_EQ(alarms["journal"], "No space left on device");
  sut->stop();
  sut->on_journal_error("");
  EXPECT_EQ(alarms["journal"], "");
  program_asks();
  EXPECT_EQ(channel.call, fabric::CallId{});
  EXPECT_EQ(channel.reason, "the gateway is ending");
}

struct Input {
  const char* name;
  std::function<void(Core&)> happens;
};

class EachInput : public CoreTest, public testing::WithParamInterface<Input> {};

// Other gateways may have taken its machines over: the link is removed before the event is handled,
// which may be the link's own.
TEST_P(EachInput, DetectsAStandstillFirst) {
  serve();
  time.steady = sut->heartbeat();
  fabric::MachineStatus other;
  other.machine = "cnc";
  other.gateway = gateway_id(9);
  other.claimed = machines::Claims::earliest + 2h;
  sut->on_machine(other);
  ASSERT_EQ(links, 1);
  log_lines.clear();
  time.steady += lease * 2;
  GetParam().happens(*sut);
  EXPECT_EQ(links, 0);
  EXPECT_THAT(log_lines, Contains(HasSubstr("this gateway stood still for 4.0 s")));
}

const fabric::ChannelKey first_channel{"cnc", 1};
const fabric::InstanceId an_instance = gateway_id(7);

INSTANTIATE_TEST_SUITE_P(
    Of, EachInput,
    testing::Values(
        Input{"change", [](Core& core) { core.change({{.name = "cnc"}}, {}); }},
        Input{"stop", [](Core& core) { core.stop(); }},
        Input{"end", [](Core& core) { core.end(); }},
        Input{"on_time", [](Core& core) { core.on_time(); }},
        Input{"heartbeat", [](Core& core) { core.heartbeat(); }},
        Input{"tell_load", [](Core& core) { core.publish_load(); }},
        Input{"on_other_event", [](Core& core) { core.on_other_event(); }},
        Input{"on_link_up", [](Core& core) { core.on_link_up("cnc", {1}); }},
        Input{"on_link_down", [](Core& core) { core.on_link_down("cnc", {"cable"}); }},
        Input{"on_read", [](Core& core) { core.on_read(first_channel, {}); }},
        Input{"on_read_failed", [](Core& core) { core.on_read_failed(first_channel, "refused"); }},
        Input{"on_write",
              [](Core& core) { core.on_write(first_channel, WriteOutcome::written, ""); }},
        Input{"on_watched",
              [](Core& core) {
                core.on_subscribed("cnc", {{1, "", false}});
              }},
        Input{"on_told",
              [](Core& core) { core.on_notification(first_channel, Variable::request_state, 1); }},
        Input{"on_answer_of_the_link", [](Core& core) { core.on_answer("cnc", {}); }},
        Input{"on_variable_request",
              [](Core& core) { core.on_variable_request({.key = first_channel}); }},
        Input{"on_queue_answer", [](Core& core) { core.on_queue_answer(first_channel, {}); }},
        Input{"on_queue_event", [](Core& core) { core.on_queue_event(first_channel); }},
        Input{"on_recorded",
              [](Core& core) {
                core.on_recorded({Ticket::Owner::channel, first_channel, 1});
              }},
        Input{"on_journal_trouble", [](Core& core) { core.on_journal_error("full"); }},
        Input{"on_instance_ready", [](Core& core) { core.on_instance_ready({.id = an_instance}); }},
        Input{"on_instance_gone", [](Core& core) { core.on_instance_gone(an_instance); }},
        Input{"on_load", [](Core& core) { core.on_load(fabric::InstanceLoad{}); }},
        Input{"on_reply", [](Core& core) { core.on_reply({.key = first_channel}); }},
        Input{"set_interest", [](Core& core) { core.set_readers({}); }},
        Input{"on_machine", [](Core& core) { core.on_machine({.machine = "other"}); }},
        Input{"on_machine_gone", [](Core& core) { core.on_machine_gone("other", an_instance); }},
        Input{"on_channel",
              [](Core& core) {
                core.on_channel({.key = {"other", 1}});
              }},
        Input{"on_answer", [](Core& core) { core.on_answer(first_channel, {}, {}); }},
        Input{"on_retry", [](Core& core) { core.on_retry(first_channel, {}, "operator"); }}),
    [](const auto& tested) { return tested.param.name; });

class ChannelTableTest : public testing::Test {
 protected:
  ChannelTableTest() {
    sut.open(first, access, context);
    sut.open(second, access, context);
  }

  std::vector<fabric::ChannelKey> due(SteadyTime now) {
    std::vector<fabric::ChannelKey> keys;
    for (const channel::Channel* const channel : sut.take_due(now)) {
      keys.push_back(channel->key());
    }
    return keys;
  }

  const SteadyTime start{1h};
  const fabric::ChannelKey first{"cnc", 1};
  const fabric::ChannelKey second{"cnc", 2};
  RecordedPorts ports;
  MessageQueues access{ports, ports};
  channel::ChannelContext context{ports, ports};
  ChannelTable sut;
};

TEST_F(ChannelTableTest, HasDueChannelsOnceInTheOrderOfTheirTimes) {
  sut.wake_at(first, start + 2s);
  sut.wake_at(second, start + 1s);
  EXPECT_EQ(sut.next_time(), start + 1s);
  EXPECT_THAT(due(start), IsEmpty());
  EXPECT_THAT(due(start + 2s), ElementsAre(second, first));
  EXPECT_THAT(due(start + 2s), IsEmpty());
  EXPECT_EQ(sut.next_time(), std::nullopt);
}

TEST_F(ChannelTableTest, WakesAChannelEarlierIfItAsksForThat) {
  sut.wake_at(first, start + 2s);
  sut.wake_at(first, start + 1s);
  EXPECT_EQ(sut.next_time(), start + 1s);
  EXPECT_THAT(due(start + 1s), ElementsAre(first));
  EXPECT_EQ(sut.next_time(), std::nullopt);
}

TEST_F(ChannelTableTest, LeavesTheTimeOfAChannelThatAsksForALaterOne) {
  sut.wake_at(first, start + 1s);
  sut.wake_at(first, start + 2s);
  EXPECT_THAT(due(start + 1s), ElementsAre(first));
  sut.wake_at(first, start + 2s);
  EXPECT_EQ(sut.next_time(), start + 2s);
}

TEST_F(ChannelTableTest, HasOneOrderOfChannelsThatAreDueTogether) {
  sut.wake_at(second, start);
  sut.wake_at(first, start);
  EXPECT_THAT(due(start), ElementsAre(first, second));
}

TEST_F(ChannelTableTest, HasEachChannelReadAsOftenAsItsMachineSays) {
  sut.set({{.name = "cnc", .intervals = {.idle = 900ms}}});
  channel::Channel& channel = *sut.find(first);
  channel.on_link_up({start, {}});
  ServiceSnapshot idle;
  idle.set = ReadSet::state;
  channel.on_read(idle, {start, {}});
  EXPECT_EQ(channel.take_news().wake_at, start + 900ms);
}

TEST_F(ChannelTableTest, WakesNoChannelThatIsRemoved) {
  sut.wake_at(first, start);
  sut.leave(first);
  EXPECT_EQ(sut.next_over(), std::nullopt);
  sut.find(first)->drain({start, {}});
  EXPECT_EQ(sut.next_over(), first);
  sut.remove(first);
  sut.remove(second);
  EXPECT_EQ(sut.next_over(), std::nullopt);
  EXPECT_EQ(sut.find(first), nullptr);
  EXPECT_EQ(sut.next_time(), std::nullopt);
  EXPECT_THAT(due(start), IsEmpty());
}

}  // namespace
}  // namespace millrace::gateway::core

namespace millrace::gateway {
namespace {

using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;
using namespace std::chrono_literals;

// Samples without readers are not formatted, which changes nothing else.
constexpr Readers no_readers{.events = false, .statuses = false, .min_level = Level::error};

class ReadersTest : public CoreCallsTest {
 protected:
  void start_before(const Readers& readers) {
    start();
    sut->set_readers(readers, now);
    link_up();
    sut->on_instance_ready(instance(1), now);
  }
};

TEST_F(ReadersTest, GetTheEventsStatesAndLinesOfACall) {
  start_before({});
  const auto actions = answered_call(1);
  EXPECT_THAT(all<EmitEvent>(actions), Not(IsEmpty()));
  EXPECT_THAT(all<PublishStatus>(actions), Not(IsEmpty()));
  EXPECT_THAT(all<Log>(actions), Not(IsEmpty()));
}

TEST_F(ReadersTest, ThatAreAbsentGetNothingAndTheCallIsStillAnswered) {
  start_before(no_readers);
  const auto actions = answered_call(1);
  EXPECT_THAT(all<EmitEvent>(actions), IsEmpty());
  EXPECT_THAT(all<PublishStatus>(actions), IsEmpty());
  EXPECT_THAT(all<Log>(actions), IsEmpty());
  EXPECT_THAT(all<Write>(actions), SizeIs(3)) << "RESPONSE, REQUEST_STATE, RESPONSE_STATE";
}

TEST_F(ReadersTest, OfTheLogOnlyGetLinesOfTheirLevel) {
  start_before({.events = false, .statuses = false, .min_level = Level::info});
  EXPECT_THAT(all<Log>(answered_call(1)), IsEmpty()) << "calls are debug";
  sut->set_readers({.events = false, .statuses = false, .min_level = Level::debug}, now);
  EXPECT_THAT(all<Log>(answered_call(2)), Not(IsEmpty()));
}

TEST_F(ReadersTest, ThatBeginGetEveryChannelAsItIs) {
  start_before(no_readers);
  confirm(request(1));
  const auto shown = all<PublishStatus>(sut->set_readers({}, now));
  ASSERT_THAT(shown, SizeIs(2));
  EXPECT_EQ(shown[0].status.state, fabric::ChannelState::running);
  EXPECT_EQ(shown[0].status.uuid, uuid);
  EXPECT_EQ(shown[0].status.instance, instance(1).id);
  EXPECT_EQ(shown[1].status.state, fabric::ChannelState::link_down) << "not read yet";
}

TEST_F(ReadersTest, ThatBeginAgainGetWhatHasChangedAndSinceWhen) {
  start_before({});
  confirm(request(1));
  sut->set_readers(no_readers, now);
  const fabric::Time given = now.wall;
  now.steady += std::chrono::seconds(5);
  now.wall += std::chrono::seconds(5);
  sut->on_time(now);
  const auto shown = all<PublishStatus>(sut->set_readers({}, now));
  ASSERT_THAT(shown, SizeIs(1)) << "DDS has the last status of the other channel";
  EXPECT_EQ(shown[0].status.since, given);
  EXPECT_EQ(shown[0].status.calls, 1U);
}

constexpr SteadyTime begin{1000s};

class StallDetectorTest : public testing::Test {
 protected:
  machines::StallDetector sut{400ms};
};

TEST_F(StallDetectorTest, SendsEightHeartbeatsALease) {
  EXPECT_EQ(sut.heartbeat(begin), begin + 50ms);
}

TEST_F(StallDetectorTest, ToleratesHalfALease) {
  const SteadyTime due = sut.heartbeat(begin);
  EXPECT_FALSE(sut.take_overdue(begin + 200ms));
  EXPECT_EQ(sut.take_overdue(begin + 201ms), begin + 201ms - due);
}

TEST_F(StallDetectorTest, ReportsEachStandstillOnce) {
  const SteadyTime due = sut.heartbeat(begin);
  EXPECT_EQ(sut.take_overdue(due + 5s), 5s);
  EXPECT_FALSE(sut.take_overdue(due + 5s));
  EXPECT_EQ(sut.take_overdue(due + 5s + 1s), 1s);
}

TEST_F(StallDetectorTest, IsNotLateBeforeItsHeartbeat) {
  EXPECT_FALSE(sut.take_overdue(begin));
}

}  // namespace
}  // namespace millrace::gateway
