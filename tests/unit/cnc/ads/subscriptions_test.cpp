#include "cnc/ads/subscriptions.hpp"

#include <deque>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/cnc/ads/memory_device.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;
using namespace std::chrono_literals;

const Address subscriber{{{127, 0, 0, 1, 2, 1}}, 32750};
const Address machine{{{127, 0, 0, 1, 1, 1}}, 552};
constexpr std::uint32_t ms = 10'000;  // on the wire, in 100 ns

class SubscriptionsTest : public testing::Test {
 protected:
  using Samples = std::vector<std::pair<std::uint32_t, Bytes>>;

  SubscriptionsTest() { device.values[{1, 1}] = {1}; }

  static AddNotificationRequest request(Transmission mode, std::uint32_t cycle = 10 * ms,
                                        std::uint32_t max_delay = 0) {
    return {{1, 1}, 1, mode, max_delay, cycle};
  }
  Result<std::uint32_t> add(const AddNotificationRequest& wanted) {
    const Header header{machine,         subscriber, Command::add_notification, flags::ads_command,
                        ErrorCode::none, 1};
    return sut.add(header, wanted, now);
  }
  void advance(std::chrono::milliseconds by) {
    now.steady += by;
    now.filetime += static_cast<std::uint64_t>(by.count()) * ms;
  }
  // The frames that are due, each as its stamps.
  std::vector<std::vector<Stamp>> frames() {
    std::vector<std::vector<Stamp>> all;
    bytes.push_back(sut.poll(now));
    readers.emplace_back(100'000).feed(bytes.back());
    for (auto frame = readers.back().next(); *frame; frame = readers.back().next()) {
      const auto packet = decode_packet((*frame)->body);
      headers.push_back(packet->header);
      all.push_back(*decode_notification(packet->data));
    }
    return all;
  }
  Samples samples() {
    Samples all;
    for (const auto& frame : frames()) {
      for (const auto& stamp : frame) {
        for (const auto& sample : stamp.samples) {
          all.emplace_back(sample.handle, Bytes(sample.data.begin(), sample.data.end()));
        }
      }
    }
    return all;
  }

  MemoryDevice device;
  SubscriptionLimits limits;
  Subscriptions sut{device, limits};
  Moment now{Subscriptions::Time(1h), 1'000'000};
  // The buffers of the decoded stamps.
  std::deque<Bytes> bytes;
  std::deque<FrameReader> readers;
  std::vector<Header> headers;
};

TEST_F(SubscriptionsTest, SendsTheFirstValueAtOnce) {
  const auto handle = add(request(Transmission::on_change));
  EXPECT_EQ(sut.next_due(), now.steady);
  const auto sent = frames();
  ASSERT_THAT(sent, SizeIs(1));
  ASSERT_THAT(sent[0], SizeIs(1));
  EXPECT_EQ(sent[0][0].time, now.filetime);
  EXPECT_EQ(sent[0][0].samples[0].handle, *handle);
  EXPECT_EQ(headers[0], (Header{subscriber, machine, Command::notification, flags::ads_command,
                                ErrorCode::none, 0}));
}

TEST_F(SubscriptionsTest, OnChangeSendsWhatDiffersFromTheLastSample) {
  add(request(Transmission::on_change));
  samples();
  advance(10ms);
  EXPECT_THAT(samples(), IsEmpty());
  device.values[{1, 1}] = {2};
  EXPECT_THAT(samples(), IsEmpty()) << "not before the cycle is over";
  advance(10ms);
  EXPECT_THAT(samples(), ElementsAre(Pair(1, Bytes{2})));
}

TEST_F(SubscriptionsTest, CyclicSendsTheValueEachCycle) {
  add(request(Transmission::cyclic));
  int count = 0;
  for (int elapsed = 0; elapsed < 100; ++elapsed) {
    count += static_cast<int>(samples().size());
    advance(1ms);
  }
  EXPECT_EQ(count, 10);
}

TEST_F(SubscriptionsTest, MissedSamplesAreNotSentLater) {
  add(request(Transmission::cyclic));
  samples();
  advance(95ms);
  EXPECT_THAT(samples(), SizeIs(1));
  EXPECT_THAT(samples(), IsEmpty());
  EXPECT_EQ(sut.next_due(), now.steady + 5ms) << "in step with the others";
}

TEST_F(SubscriptionsTest, SamplesAllOfACycleTogether) {
  for (int i = 0; i < 50; ++i) {
    add(request(Transmission::cyclic, ms));
    now.steady += 10us;
    samples();
  }
  headers.clear();
  int moments = 0;
  for (const auto end = now.steady + 10ms; now.steady < end; now.steady = *sut.next_due()) {
    const auto sent = frames();
    moments += sent.empty() ? 0 : 1;
    ASSERT_LE(sent.size(), 1U);
  }
  EXPECT_LE(moments, 11);
}

TEST_F(SubscriptionsTest, SamplesInWholeCyclesOfTheTask) {
  limits.task_cycle = 4ms;
  Subscriptions slow(device, limits);
  const Header header{machine,         subscriber, Command::add_notification, flags::ads_command,
                      ErrorCode::none, 1};
  ASSERT_TRUE(slow.add(header, request(Transmission::cyclic, 5 * ms), now));
  slow.poll(now);
  EXPECT_EQ(slow.next_due(), now.steady + 8ms);
}

// 550 subscriptions of one byte each, whose samples wait for their max delay.
TEST_F(SubscriptionsTest, BoundsWhatWaitsForAnEndlessDelayHoweverSmallItIs) {
  for (std::uint16_t port = 0; port < 550; ++port) {
    const Header header{machine,
                        {subscriber.net_id, port},
                        Command::add_notification,
                        flags::ads_command,
                        ErrorCode::none,
                        1};
    ASSERT_TRUE(sut.add(header, request(Transmission::cyclic, ms, 0xFFFFFFFF), now));
  }
  std::size_t sent = 0;
  for (int cycle = 0; cycle < 100; ++cycle) {
    sent += sut.poll(now).size();
    advance(1ms);
  }
  constexpr std::size_t samples = 55'000;
  EXPECT_GT(sent, samples * 9 * 9 / 10) << "nearly all have left";
}

TEST_F(SubscriptionsTest, RefusesSubscriptionsByHandleIfConfigured) {
  limits.habits.by_handle = ErrorCode::no_more_handles;
  Subscriptions strict(device, limits);
  const Header header{machine,         subscriber, Command::add_notification, flags::ads_command,
                      ErrorCode::none, 1};
  auto by_handle = request(Transmission::on_change);
  by_handle.index = {0xF005, 1};
  device.values[{0xF005, 1}] = {1};
  EXPECT_EQ(strict.add(header, by_handle, now).error(), ErrorCode::no_more_handles);
  EXPECT_TRUE(strict.add(header, request(Transmission::on_change), now));
}

// A server's faults with subscriptions.
class SubscriptionBehaviourTest : public SubscriptionsTest {
 protected:
  // The notifications of ten values, one in each cycle.
  std::vector<std::uint8_t> notified_values(const SubscriptionBehaviour& habits) {
    limits.habits = habits;
    Subscriptions with(device, limits);
    const Header header{machine,         subscriber, Command::add_notification, flags::ads_command,
                        ErrorCode::none, 1};
    EXPECT_TRUE(with.add(header, request(Transmission::on_change, ms), now));
    std::vector<std::uint8_t> values;
    for (std::uint8_t value = 0; value < 10; ++value) {
      device.values[{1, 1}] = {value};
      bytes.push_back(with.poll(now));
      readers.emplace_back(100'000).feed(bytes.back());
      for (auto frame = readers.back().next(); *frame; frame = readers.back().next()) {
        const auto packet = decode_packet((*frame)->body);
        const auto stamps = decode_notification(packet->data);
        for (const auto& stamp : *stamps) {
          values.push_back(stamp.samples.front().data[0]);
        }
      }
      advance(1ms);
    }
    return values;
  }
};

TEST_F(SubscriptionBehaviourTest, NotifiesAllChanges) {
  EXPECT_THAT(notified_values({}), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
}

TEST_F(SubscriptionBehaviourTest, NotifiesTheFirstValueOnly) {
  EXPECT_THAT(notified_values({.tells = SubscriptionBehaviour::Notifies::first_value}),
              ElementsAre(0));
}

TEST_F(SubscriptionBehaviourTest, NotifiesNothing) {
  EXPECT_THAT(notified_values({.tells = SubscriptionBehaviour::Notifies::nothing}), IsEmpty());
}

TEST_F(SubscriptionBehaviourTest, LosesEveryThirdNotification) {
  EXPECT_THAT(notified_values({.lose_every = 3}), ElementsAre(0, 1, 3, 4, 6, 7, 9));
}

TEST_F(SubscriptionBehaviourTest, NotifiesLate) {
  EXPECT_THAT(notified_values({.delay = 7ms}), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
}

TEST_F(SubscriptionsTest, SamplesAtMostOnceInATaskCycle) {
  add(request(Transmission::cyclic, 0));
  samples();
  EXPECT_EQ(sut.next_due(), now.steady + limits.task_cycle);
}

TEST_F(SubscriptionsTest, SharesOneStampAmongValuesOfOneMoment) {
  add(request(Transmission::cyclic));
  add(request(Transmission::on_change));
  const auto sent = frames();
  ASSERT_THAT(sent, SizeIs(1));
  ASSERT_THAT(sent[0], SizeIs(1));
  EXPECT_THAT(sent[0][0].samples, SizeIs(2));
}

TEST_F(SubscriptionsTest, CollectsSamplesForTheMaxDelay) {
  add(request(Transmission::cyclic, 10 * ms, 25 * ms));
  EXPECT_THAT(frames(), IsEmpty());
  advance(10ms);
  EXPECT_THAT(frames(), IsEmpty());
  advance(10ms);
  EXPECT_THAT(frames(), IsEmpty());
  EXPECT_EQ(sut.next_due(), now.steady + 5ms);
  advance(5ms);
  const auto sent = frames();
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_THAT(sent[0], SizeIs(3)) << "three moments in one frame";
}

TEST_F(SubscriptionsTest, SendsEarlierWhenTooMuchIsCollected) {
  device.values[{1, 1}] = Bytes(40'000);
  auto large = request(Transmission::cyclic, 10 * ms, 1'000'000 * ms);
  large.length = 40'000;
  add(large);
  EXPECT_THAT(frames(), IsEmpty());
  advance(10ms);
  EXPECT_THAT(frames(), SizeIs(1));
}

// The bytes already sent were still counted as collected.
TEST_F(SubscriptionsTest, CollectsForTheMaxDelayHoweverMuchWasSentBefore) {
  device.values[{1, 1}] = Bytes(30'000);
  auto large = request(Transmission::cyclic, 10 * ms, 5 * ms);
  large.length = 30'000;
  add(large);
  for (int round = 0; round < 10; ++round) {
    ASSERT_THAT(frames(), IsEmpty()) << round;
    advance(5ms);
    ASSERT_THAT(frames(), SizeIs(1)) << round;
    advance(5ms);
  }
}

TEST_F(SubscriptionsTest, NotifiesOnceThatAValueIsGone) {
  add(request(Transmission::cyclic));
  samples();
  device.values.clear();
  advance(10ms);
  EXPECT_THAT(samples(), ElementsAre(Pair(1, IsEmpty())));
  advance(10ms);
  EXPECT_THAT(samples(), IsEmpty());
  EXPECT_EQ(sut.next_due(), std::nullopt);
}

TEST_F(SubscriptionsTest, ARemovedOneIsSilentAlsoAboutWhatWasCollected) {
  const auto first = add(request(Transmission::cyclic, 10 * ms, 25 * ms));
  samples();
  EXPECT_TRUE(sut.remove(*first));
  advance(100ms);
  EXPECT_THAT(samples(), IsEmpty());
  EXPECT_EQ(sut.next_due(), std::nullopt);
  EXPECT_EQ(sut.remove(*first).error(), ErrorCode::invalid_handle);
}

TEST_F(SubscriptionsTest, RefusesWhatItCannotDo) {
  EXPECT_EQ(add(request(Transmission{1})).error(), ErrorCode::transmission_not_supported);
  auto nowhere = request(Transmission::cyclic);
  nowhere.index = {9, 9};
  EXPECT_EQ(add(nowhere).error(), ErrorCode::invalid_group);
  for (std::size_t i = 0; i < limits.handles; ++i) {
    ASSERT_TRUE(add(request(Transmission::cyclic)));
  }
  EXPECT_EQ(add(request(Transmission::cyclic)).error(), ErrorCode::no_more_handles);
  EXPECT_EQ(sut.size(), limits.handles);
}

class NotificationAnswerTest : public SubscriptionsTest {
 protected:
  std::optional<Bytes> answer(Command command, const Bytes& payload) {
    const Header header{machine, subscriber, command, flags::ads_command, ErrorCode::none, 1};
    return answer_notification(sut, {header, payload}, now);
  }
  std::optional<Bytes> answer_sum(std::uint32_t group, std::uint32_t count, std::uint32_t room,
                                  const Bytes& items) {
    return answer(Command::read_write, encode(ReadWriteRequest{{group, count}, room, items}));
  }
};

TEST_F(NotificationAnswerTest, AddsAndDeletesOne) {
  EXPECT_EQ(answer(Command::add_notification, encode(request(Transmission::cyclic))),
            encode_handle(1U));
  EXPECT_EQ(answer(Command::delete_notification, encode(DeleteNotificationRequest{1})),
            encode_result({}));
  EXPECT_EQ(answer(Command::delete_notification, encode(DeleteNotificationRequest{1})),
            encode_result(tl::make_unexpected(ErrorCode::invalid_handle)));
}

TEST_F(NotificationAnswerTest, AddsAndDeletesManyWithAResultForEach) {
  Bytes items = encode(request(Transmission::cyclic));
  const auto bad = encode(request(Transmission{1}));
  items.insert(items.end(), bad.begin(), bad.end());
  EXPECT_EQ(answer_sum(sum::add_notifications, 2, 16, items),
            encode_data(ByteWriter().u32(0).u32(1).u32(0x713).u32(0).take()));
  EXPECT_EQ(answer_sum(sum::delete_notifications, 2, 8, ByteWriter().u32(1).u32(5).take()),
            encode_data(ByteWriter().u32(0).u32(0x714).take()));
  EXPECT_EQ(sut.size(), 0U);
}

TEST_F(NotificationAnswerTest, RefusesSumsWhoseLengthsDoNotFit) {
  const auto invalid = encode_data(tl::make_unexpected(ErrorCode::invalid_size));
  const auto item = encode(request(Transmission::cyclic));
  EXPECT_EQ(answer_sum(sum::add_notifications, 2, 16, item), invalid);
  EXPECT_EQ(answer_sum(sum::add_notifications, 1, 7, item), invalid);
  EXPECT_EQ(answer_sum(sum::delete_notifications, 0xFFFFFFFF, 8, {}), invalid);
  EXPECT_EQ(sut.size(), 0U);
}

TEST_F(NotificationAnswerTest, LeavesOtherRequestsAlone) {
  EXPECT_EQ(answer(Command::read, encode(ReadRequest{{1, 1}, 4})), std::nullopt);
  EXPECT_EQ(answer_sum(0xF080, 1, 4, {}), std::nullopt);
  EXPECT_EQ(answer(Command::add_notification, {1, 2}), std::nullopt);
}

}  // namespace
}  // namespace millrace::cnc::ads
