#include "fabric/wire/subscription.hpp"

#include <boost/asio/post.hpp>
#include <gmock/gmock.h>

#include "fabric/wire/writer.hpp"
#include "tests/support/await.hpp"
#include "tests/support/run_until.hpp"
#include "tests/unit/fabric/two_processes.hpp"

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
