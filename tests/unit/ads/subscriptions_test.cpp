#include "cnc/ads/subscriptions.hpp"

#include <deque>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/notification_answer.hpp"
#include "tests/unit/ads/memory_device.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;
using namespace std::chrono_literals;

const Address client{{{127, 0, 0, 1, 2, 1}}, 32750};
const Address controller{{{127, 0, 0, 1, 1, 1}}, 552};
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
    const Header header{controller,         client,          Command::add_notification,
                        flags::ads_command, ErrorCode::none, 1};
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
  // What the decoded stamps point into.
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
  EXPECT_EQ(headers[0], (Header{client, controller, Command::notification, flags::ads_command,
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

TEST_F(SubscriptionsTest, WhatWasMissedIsNotMadeUpFor) {
  add(request(Transmission::cyclic));
  samples();
  advance(95ms);
  EXPECT_THAT(samples(), SizeIs(1));
  EXPECT_THAT(samples(), IsEmpty());
  EXPECT_EQ(sut.next_due(), now.steady + 10ms);
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

TEST_F(SubscriptionsTest, TellsOnceThatAValueIsGone) {
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
    const Header header{controller, client, command, flags::ads_command, ErrorCode::none, 1};
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
