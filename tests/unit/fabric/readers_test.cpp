// A pure listener receives every call, also one that is over before it could arrive.
#include <stdexcept>
#include <thread>
#include <vector>

#include <boost/asio/post.hpp>
#include <dds/dds.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include "fabric/dds/listeners.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/subscription.hpp"
#include "fabric/wire/writer.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/support/await.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/fabric/two_processes.hpp"

namespace millrace::fabric {
namespace {

using testing::ElementsAre;

const ChannelKey cnc_1{.machine = "cnc", .channel = 1};

Request request(std::uint64_t number) {
  return {.key = cnc_1, .call = {0x5f, number}, .uuid = "weather"};
}

Reply reply(std::uint64_t number) {
  return {.key = cnc_1, .call = {0x5f, number}, .text = "sun", .state = 1};
}

template <typename Value>
void match(const wire::Writer<Value>& writer) {
  boost::asio::io_context context;
  ASSERT_TRUE(tests::run_until(context, [&] { return !writer.matched().empty(); }));
}

class ARecordersReader : public testing::Test {
 protected:
  /// Waits until `here` has discovered the readers of `there`, one after the other.
  void await_discovery() {
    const wire::Reader<Event> last(there, "millrace", wire::Keep::all);
    const wire::Writer<Event> writer(here, "millrace");
    match(writer);
  }

  /// The numbers of the calls that have arrived, as soon as there are `count`, or at the timeout.
  template <typename Value>
  std::vector<std::uint64_t> numbers(wire::Reader<Value>& reader, std::size_t count) {
    std::vector<std::uint64_t> numbers;
    boost::asio::io_context context;
    tests::run_until(context, [&] {
      for (const wire::Taken<Value>& taken : reader.take()) {
        if (taken.valid) {
          numbers.push_back(taken.value.call.number);
        }
      }
      return numbers.size() >= count;
    });
    return numbers;
  }

  TwoProcesses processes;
  dds::Participant here{processes.here()};
  dds::Participant there{processes.there()};
};

TEST_F(ARecordersReader, GetsTheCallsThatAreOverBeforeItFindsTheirWriter) {
  wire::Reader<Request> sut(there, "millrace/*", wire::Keep::all);
  await_discovery();
  wire::Writer<Request> writer(here, "millrace/weather");
  for (std::uint64_t number = 1; number <= 5; ++number) {
    ASSERT_TRUE(writer.write(request(number)));
    writer.withdraw(request(number));
  }
  EXPECT_THAT(numbers(sut, 5), ElementsAre(1, 2, 3, 4, 5));
}

TEST_F(ARecordersReader, GetsTheRepliesThatOthersFollowBeforeItFindsTheirWriter) {
  wire::Reader<Reply> sut(there, "millrace/*", wire::Keep::all);
  await_discovery();
  wire::Writer<Reply> writer(here, "millrace/weather");
  for (std::uint64_t number = 1; number <= 5; ++number) {
    ASSERT_TRUE(writer.write(reply(number)));
  }
  EXPECT_THAT(numbers(sut, 5), ElementsAre(1, 2, 3, 4, 5));
}

TEST_F(ARecordersReader, GetsTheNewestSampleOnlyIfItJoinsLater) {
  wire::Writer<Request> requests(here, "millrace/weather");
  wire::Writer<Reply> replies(here, "millrace/weather");
  for (std::uint64_t number = 1; number <= 5; ++number) {
    ASSERT_TRUE(requests.write(request(number)));
    ASSERT_TRUE(replies.write(reply(number)));
  }
  wire::Reader<Request> late_requests(there, "millrace/*", wire::Keep::all);
  wire::Reader<Reply> late_replies(there, "millrace/*", wire::Keep::all);
  EXPECT_THAT(numbers(late_requests, 1), ElementsAre(5));
  EXPECT_THAT(numbers(late_replies, 1), ElementsAre(5));
}

// An observer cannot slow down or stop calls.

/// Longer than the test, so that the silent side remains alive for DDS.
constexpr std::chrono::milliseconds lease = std::chrono::seconds(60);

class SlowReader : public testing::Test {
 protected:
  /// From here on the other side acknowledges nothing.
  void freeze() {
    ASSERT_EQ(dds_domain_set_deafmute(there.handle(), true, true, DDS_INFINITY), DDS_RETCODE_OK);
  }

  static dds::ParticipantOptions with_lease(dds::ParticipantOptions options) {
    options.lease = lease;
    return options;
  }

  TwoProcesses processes;
  dds::Participant here{with_lease(processes.here())};
  dds::Participant there{with_lease(processes.there())};
};

TEST_F(SlowReader, DoesNotHoldUpEvents) {
  wire::Writer<Event> sut(here, "millrace");
  const wire::Reader<Event> recorder(there, "millrace", wire::Keep::all);
  match(sut);
  freeze();
  Event event{.key = {.machine = "cnc", .channel = 1}, .uuid = "weather"};
  event.text.assign(max_text, 'x');
  event.detail = std::string(255, 'x');
  for (int i = 0; i < 20'000; ++i) {
    const auto written = sut.write(event);
    ASSERT_TRUE(written) << "event " << i << ": " << written.error();
  }
}

TEST_F(SlowReader, DoesNotHoldUpTheCallsOfOtherChannels) {
  wire::Writer<Request> sut(here, "millrace/weather");
  const wire::Reader<Request> service(there, "millrace/weather", wire::Keep::last);
  match(sut);
  freeze();
  Request request{.key = {.machine = "cnc"}, .uuid = "weather"};
  request.text.assign(max_text, 'x');
  for (std::uint16_t channel = 1; channel <= 1000; ++channel) {
    request.key.channel = channel;
    const auto written = sut.write(request);
    ASSERT_TRUE(written) << "channel " << channel << ": " << written.error();
  }
}

/// Bytes that the process has allocated and not freed; 0 under a sanitizer.
std::size_t allocated() {
  const struct mallinfo2 use = ::mallinfo2();
  return use.uordblks + use.hblkhd;
}

// Cyclone's own buffers have 4 kB for each sample of more than 128 bytes.
TEST_F(SlowReader, CostsNoMoreThanTheBytesOfWhatItDoesNotRead) {
  wire::Writer<Reply> sut(here, "millrace/weather");
  const wire::Reader<Reply> service(there, "millrace/weather", wire::Keep::last);
  match(sut);
  freeze();
  constexpr std::uint16_t channels = 4000;
  const std::size_t before = allocated();
  Reply reply{.key = {.machine = "cnc"}, .text = std::string(max_text, 'x'), .state = 1};
  for (std::uint16_t channel = 1; channel <= channels; ++channel) {
    reply.key.channel = channel;
    ASSERT_TRUE(sut.write(reply));
  }
  const std::size_t each = (allocated() - before) / channels;
  EXPECT_TRUE(bench::keeps_what_is_freed || (each > 200 && each < 2048)) << each << " bytes each";
}

// Without the hold, Cyclone creates and frees the instance for each event.
TEST_F(SlowReader, IsNotWhatHoldsTheOneInstanceOfATopicWithoutAKey) {
  wire::Writer<Event> sut(here, "millrace");
  const auto held = sut.hold({.key = {.machine = "any", .channel = 1}});
  EXPECT_TRUE(held) << held.error();
  EXPECT_FALSE(sut.hold({})) << "an event without a machine is invalid";
}

TEST(SerialListener, RunsNothingBeforeItIsOpened) {
  int runs = 0;
  dds::SerialListener sut([&] { ++runs; });
  sut.run();
  EXPECT_EQ(runs, 0);
  sut.open();
  EXPECT_GE(runs, 1);
}

TEST(SerialListener, RunsOnceMoreForWhatComesDuringTheWork) {
  int runs = 0;
  dds::SerialListener* sut = nullptr;
  dds::SerialListener serial([&] {
    if (++runs == 1) {
      sut->run();
      EXPECT_EQ(runs, 1) << "not within itself";
    }
  });
  sut = &serial;
  serial.open();
  EXPECT_EQ(runs, 2);
}

// A regression: the next thread assumed that another one ran the work already, and left, so no
// further samples were taken.
TEST(SerialListener, ContinuesAfterWorkThatThrows) {
  int runs = 0;
  dds::SerialListener sut([&] {
    if (++runs <= 2) {
      throw std::runtime_error("on purpose, by a test");
    }
  });
  sut.open();
  sut.run();
  sut.run();
  EXPECT_EQ(runs, 3);
}

TEST(SerialListener, RunsInOneThreadAtATimeAndMissesNothing) {
  constexpr int threads = 4;
  constexpr int each = 20'000;
  std::atomic<int> brought = 0;
  // Neither is atomic: the thread sanitizer, at the latest, would find two threads.
  int inside = 0;
  int seen = 0;
  dds::SerialListener sut([&] {
    EXPECT_EQ(++inside, 1);
    seen = brought.load();
    --inside;
  });
  sut.open();
  std::vector<std::jthread> all;
  for (int i = 0; i < threads; ++i) {
    all.emplace_back([&] {
      for (int j = 0; j < each; ++j) {
        ++brought;
        sut.run();
      }
    });
  }
  all.clear();
  EXPECT_EQ(seen, threads * each);
}

}  // namespace
}  // namespace millrace::fabric

namespace millrace::fabric::wire {
namespace {

class ASubscription : public testing::Test {
 protected:
  void subscribe(SubscriptionOptions options = {}) {
    sut.emplace(
        here, context.get_executor(), "millrace",
        [this](const Taken<Event>& taken) {
          if (taken.valid) {
            numbers.push_back(taken.value.call.number);
            on_event();
          }
        },
        std::move(options));
    ASSERT_TRUE(until([&] { return !writer.matched().empty(); }));
  }
  void write(std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t number = from; number <= to; ++number) {
      ASSERT_TRUE(writer.write(
          {.key = {.machine = "cnc", .channel = 1}, .call = {.epoch = 1, .number = number}}));
    }
  }
  bool until(const std::function<bool()>& done) { return tests::run_until(context, done); }

  TwoProcesses processes;
  boost::asio::io_context context;
  dds::Participant here{processes.here()};
  dds::Participant there{processes.there()};
  Writer<Event> writer{there, "millrace"};
  std::vector<std::uint64_t> numbers;
  std::function<void()> on_event = [] {};
  std::optional<Subscription<Event>> sut;
};

TEST_F(ASubscription, CanBeEndedByItsFunction) {
  subscribe();
  on_event = [&] { sut.reset(); };
  write(1, 3);
  ASSERT_TRUE(until([&] { return !numbers.empty(); }));
  context.restart();
  context.poll();
  EXPECT_THAT(numbers, testing::ElementsAre(1));
}

TEST_F(ASubscription, LetsOthersHaveTheirTurnAfterItsBatches) {
  Reader<Event> witness(here, "millrace", Keep::all);
  subscribe({.batches_per_turn = 1});
  ASSERT_TRUE(until([&] { return writer.matched().size() == 2; }));
  std::size_t at_their_turn = 0;
  std::size_t arrived = 0;
  write(1, 1);
  on_event = [&] {
    if (numbers.size() == 1) {
      write(2, 100);
      boost::asio::post(context, [&] { at_their_turn = numbers.size(); });
      tests::await("all events", [&] { return (arrived += witness.take().size()) == 100; });
    }
  };
  ASSERT_TRUE(until([&] { return numbers.size() == 100 && at_their_turn > 0; }));
  EXPECT_LT(at_their_turn, 100U);
}

}  // namespace
}  // namespace millrace::fabric::wire
