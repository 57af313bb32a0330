// Message queues in random storms: gateway and service are killed, links cut, the controller
// refuses, in any order and as often as it comes. MILLRACE_QUEUE_SEEDS=FIRST..LAST runs others than
// the usual seeds.
#include <algorithm>
#include <cstdlib>
#include <map>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "tests/unit/gateway/queue_plant.hpp"

namespace millrace::gateway {
namespace {

/// What is wrong in the end; empty if nothing is.
std::string storm(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto below = [&](std::uint64_t n) { return random() % n; };
  QueuePlant plant(static_cast<std::uint32_t>(3 + below(6)),
                   below(2) == 0 ? queues::Drain::journalled : queues::Drain::when_answered);
  plant.settings.backlog = 2 + below(20);
  plant.start();
  const int messages = static_cast<int>(10 + below(40));
  const bool repeats = below(3) == 0;
  const auto text = [&](int number) {
    return repeats ? std::to_string(number % 2) : std::to_string(number);
  };
  const auto violence = 5 + below(60);
  int written = 0;
  for (int i = 0; written < messages; ++i) {
    if (i > 200'000) {
      return "it does not come to an end";
    }
    if (i == 20) {
      plant.serve();
    }
    if (below(4) == 0 && plant.ring.write(text(written + 1))) {
      ++written;
    }
    plant.refuses = below(20) == 0;
    if (below(1000) < violence) {
      switch (below(5)) {
        case 0:
          plant.crash();
          break;
        case 1:
          plant.kill_service();
          break;
        case 2:
          plant.cut_link(below(2) == 0);
          break;
        case 3:
          plant.queue->on_event(plant.now);
          break;
        default:
          plant.pass(std::chrono::milliseconds(below(700)));
          break;
      }
    }
    if (!plant.step()) {
      plant.pass(std::chrono::milliseconds(10));
    }
  }
  plant.refuses = false;
  for (int round = 0; round < 10; ++round) {
    if (!plant.settle()) {
      return "it does not come to rest";
    }
  }
  std::vector<std::string> order;
  std::set<fabric::CallId> seen;
  for (const auto& [call, what] : plant.executed) {
    if (seen.insert(call).second) {
      order.push_back(what);
    }
  }
  std::vector<std::string> expected;
  for (int number = 1; number <= messages; ++number) {
    expected.push_back(text(number));
  }
  if (order != expected) {
    return "executed " + std::to_string(order.size()) + ": " + testing::PrintToString(order) +
           " instead of " + std::to_string(expected.size()) + ": " +
           testing::PrintToString(expected) + "; waiting " +
           std::to_string(plant.queue->view().waiting) + ", LastGet " +
           std::to_string(plant.ring.last_get) + ", LastFilled " +
           std::to_string(plant.ring.last_filled) + ", calls open " +
           std::to_string(plant.ledger.open_calls().size()) + ", request state " +
           std::to_string(plant.queue->look(ReadSet::all).request_state) + ", todo " +
           std::to_string(plant.todo.size()) + "; said " + testing::PrintToString(plant.lines);
  }
  if (plant.ring.last_get != plant.ring.last_filled) {
    return "messages stand in the queue";
  }
  return plant.ledger.open_calls().empty() ? "" : "a call is open";
}

TEST(MessageQueueInAStorm, LosesNothingKeepsItsOrderAndRepeatsUnderTheSameId) {
  std::uint64_t first = 1;
  std::uint64_t last = 1000;
  if (const char* seeds = std::getenv("MILLRACE_QUEUE_SEEDS")) {
    char* end = nullptr;
    first = std::strtoull(seeds, &end, 10);
    last = std::strtoull(end + 2, nullptr, 10);
  }
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    const std::string wrong = storm(seed);
    ASSERT_EQ(wrong, "") << "seed " << seed;
  }
}

}  // namespace
}  // namespace millrace::gateway
