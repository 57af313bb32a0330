// Every order of events of one channel, two instances and one mishap.
#include <cstdlib>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/simulation/exhaustive/explorer.hpp"
#include "tests/simulation/exhaustive/small_plant.hpp"

namespace millrace::tests::simulation {
namespace {

struct Seen {
  std::vector<std::string> violations;
  std::vector<std::size_t> choices;
  std::size_t states = 0;
  std::size_t runs = 0;
  bool complete = false;
};

Seen explore(const SmallPlan& plan, const Bounds& bounds) {
  Explorer explorer(bounds);
  Seen seen;
  do {
    explorer.begin();
    seen.violations = SmallPlant(explorer, plan).run();
  } while (seen.violations.empty() && explorer.next());
  seen.choices = explorer.choices();
  seen.states = explorer.states();
  seen.runs = explorer.runs();
  seen.complete = explorer.complete();
  return seen;
}

/// More by hand: MILLRACE_RUNS=1000000 simulation_test --gtest_filter=*EveryOrder*
std::size_t most_runs() {
  const char* runs = std::getenv("MILLRACE_RUNS");
  return runs != nullptr ? std::strtoull(runs, nullptr, 10) : 6'000;
}

unsigned wanted(const char* name) {
  const char* number = std::getenv(name);
  return number != nullptr ? static_cast<unsigned>(std::atoi(number)) : 0;
}

Bounds within(std::size_t runs) {
  return {.early_timers = wanted("MILLRACE_EARLY_TIMERS"),
          .together = std::chrono::microseconds(wanted("MILLRACE_TIMERS_TOGETHER_US")),
          .most_runs = runs};
}

struct Named {
  const char* name;
  SmallPlan plan;
  /// An ordinary test walks it to its end.
  bool whole = false;
};

class EveryOrder : public testing::TestWithParam<Named> {};

TEST_P(EveryOrder, KeepsItsPromises) {
  const Bounds bounds = within(most_runs());
  const Seen seen = explore(GetParam().plan, bounds);
  RecordProperty("states", static_cast<int>(seen.states));
  fmt::print("{} states, {} runs{}\n", seen.states, seen.runs, seen.complete ? "" : ", not all");
  ASSERT_TRUE(seen.violations.empty()) << [&] {
    std::string words = seen.violations.front();
    Explorer again(bounds);
    again.repeat(seen.choices);
    again.begin();
    SmallPlant(again, GetParam().plan, [&](const std::string& line) {
      words += "\n" + line;
    }).run();
    return words;
  }();
  EXPECT_GT(seen.states, 100U);
  EXPECT_TRUE(seen.complete || !GetParam().whole);
}

constexpr auto once = fabric::Delivery::at_most_once;
constexpr auto often = fabric::Delivery::at_least_once;
constexpr cnc::simulator::ServiceRules clears{.response_clears_request = true};

INSTANTIATE_TEST_SUITE_P(
    Of, EveryOrder,
    testing::Values(
        Named{"Nothing", {.mishap = Mishap::none}, true},
        Named{"GatewayKilled", {.mishap = Mishap::gateway_killed, .delivery = often}},
        Named{"GatewayKilledOnceWritesLost",
              {.mishap = Mishap::gateway_killed, .delivery = once, .leftovers_dropped = true}},
        Named{"GatewayPowerCutKernelClears",
              {.mishap = Mishap::gateway_power_cut, .delivery = once, .rules = clears}},
        Named{"InstanceKilled", {.mishap = Mishap::instance_killed, .delivery = often}},
        Named{"InstanceKilledOnce", {.mishap = Mishap::instance_killed, .delivery = once}},
        Named{"InstanceDrained", {.mishap = Mishap::instance_drained, .delivery = once}},
        Named{"LinkCut", {.mishap = Mishap::link_cut, .delivery = often}},
        Named{"LinkCutWritesLost",
              {.mishap = Mishap::link_cut,
               .delivery = once,
               .rules = clears,
               .leftovers_dropped = true}},
        Named{"ProgramReset", {.mishap = Mishap::program_reset, .delivery = once}}),
    [](const auto& one) { return std::string(one.param.name); });

TEST(EveryOrderWithAMistake, FindsThatTheStateIsWrittenBeforeTheText) {
  EXPECT_FALSE(explore({.bug = Bug::state_before_text}, within(20'000)).violations.empty());
}

}  // namespace
}  // namespace millrace::tests::simulation
