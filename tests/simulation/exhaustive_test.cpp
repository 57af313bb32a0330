// Every order of events of one channel, two instances and one mishap.
#include <algorithm>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/simulation/exhaustive/small_plant.hpp"
#include "tests/simulation/gateway/bug.hpp"

namespace millrace::tests::simulation {
namespace {

/// The longer walks are run by hand (docs/dev/simulation.md).
constexpr std::size_t some_runs = 6'000;
constexpr std::size_t to_the_end = 1'000'000;

constexpr Bounds within(std::size_t runs) {
  return {.early_timers = 0, .most_runs = runs};
}

struct Named {
  const char* name;
  SmallPlan plan;
  bool whole = false;
  friend void PrintTo(const Named& named, std::ostream* out) { *out << named.name; }
};

class EveryOrder : public testing::TestWithParam<Named> {};

TEST_P(EveryOrder, KeepsAllInvariants) {
  const Bounds bounds = within(GetParam().whole ? to_the_end : some_runs);
  const Walk walk = walk_through(GetParam().plan, bounds);
  RecordProperty("states", static_cast<int>(walk.states));
  fmt::print("{} states, {} runs{}\n", walk.states, walk.runs, walk.complete ? "" : ", not all");
  ASSERT_TRUE(walk.violations.empty())
      << fmt::format("{}", fmt::join(retell(GetParam().plan, bounds, walk), "\n"));
  EXPECT_GT(walk.states, 50U);
  EXPECT_EQ(walk.complete, GetParam().whole);
}

constexpr auto once = fabric::Delivery::at_most_once;
constexpr auto often = fabric::Delivery::at_least_once;
constexpr auto text = fabric::CompletionSignal::response;
constexpr cnc::simulator::ServiceRules clears{.response_clears_request = true};
constexpr WriteBehaviour late{.response = 5ms, .request_state = 10ms, .response_state = 5ms};
constexpr cnc::simulator::ServiceRules resets{.reset_clears_states = true};

INSTANTIATE_TEST_SUITE_P(
    Of, EveryOrder,
    testing::Values(
        Named{"Nothing", {.mishap = Mishap::none}, true},
        Named{"WritesLate", {.mishap = Mishap::none, .calls = 2, .writes = late}},
        Named{"GatewayKilled", {.mishap = Mishap::gateway_killed, .delivery = often}, true},
        Named{"GatewayKilledOnceWritesLost",
              {.mishap = Mishap::gateway_killed, .delivery = once, .leftovers_dropped = true},
              true},
        Named{"GatewayPowerCutKernelClears",
              {.mishap = Mishap::gateway_power_cut, .delivery = once, .rules = clears}},
        Named{"InstanceKilled", {.mishap = Mishap::instance_killed, .delivery = often}, true},
        Named{"InstanceKilledOnce", {.mishap = Mishap::instance_killed, .delivery = once}, true},
        Named{"InstanceDrained", {.mishap = Mishap::instance_drained, .delivery = once}, true},
        Named{"LinkCut", {.mishap = Mishap::link_cut, .delivery = often}, true},
        Named{"LinkCutWritesLost",
              {.mishap = Mishap::link_cut,
               .delivery = once,
               .rules = clears,
               .leftovers_dropped = true},
              true},
        Named{
            "LinkCutResponseAwaited",
            {.mishap = Mishap::link_cut, .delivery = often, .completion_signal = text, .calls = 2}},
        Named{"LinkSilentResponseAwaited",
              {.mishap = Mishap::link_silent, .delivery = often, .completion_signal = text},
              true},
        Named{"GatewayKilledResponseAwaited",
              {.mishap = Mishap::gateway_killed, .delivery = often, .completion_signal = text}},
        Named{"LinkSilent", {.mishap = Mishap::link_silent, .delivery = once}, true},
        Named{"ProgramReset", {.mishap = Mishap::program_reset, .delivery = once}, true}),
    [](const auto& tested) { return std::string(tested.param.name); });

struct Mistaken {
  Bug bug;
  SmallPlan plan;
  [[nodiscard]] std::string_view name() const {
    return std::ranges::find(bug_names, bug, &BugName::bug)->name;
  }
  friend void PrintTo(const Mistaken& mistaken, std::ostream* out) { *out << mistaken.name(); }
};

/// A state that counts as known must not hide the consequences of a mistake.
class EveryOrderWithABug : public testing::TestWithParam<Mistaken> {};

TEST_P(EveryOrderWithABug, ViolatesAnInvariant) {
  SmallPlan plan = GetParam().plan;
  EXPECT_TRUE(walk_through(plan, within(some_runs)).violations.empty());
  plan.bug = GetParam().bug;
  const Walk walk = walk_through(plan, within(to_the_end));
  ASSERT_FALSE(walk.violations.empty());
  fmt::print("{} states, {} runs: {}\n", walk.states, walk.runs, walk.violations.front());
}

INSTANTIATE_TEST_SUITE_P(
    Of, EveryOrderWithABug,
    testing::Values(Mistaken{Bug::state_before_text, {.mishap = Mishap::none}},
                    Mistaken{Bug::instance_loss_ignored, {.mishap = Mishap::instance_killed}},
                    Mistaken{Bug::no_confirming_look,
                             {.mishap = Mishap::program_reset, .rules = resets, .calls = 2}},
                    Mistaken{Bug::answer_without_look, {.mishap = Mishap::none}},
                    Mistaken{Bug::at_most_once_forgotten,
                             {.mishap = Mishap::instance_killed, .delivery = once}},
                    Mistaken{Bug::clearing_not_journalled, {.mishap = Mishap::gateway_killed}},
                    Mistaken{Bug::acknowledged_is_seen,
                             {.mishap = Mishap::none, .calls = 2, .writes = late}}),
    [](const auto& tested) {
      std::string name(tested.param.name());
      std::ranges::replace(name, '-', '_');
      return name;
    });

/// Random orders come to no state that the walk has not seen.
class ARandomOrder : public testing::TestWithParam<Mishap> {};

TEST_P(ARandomOrder, LeadsToStatesThatTheWalkHasSeen) {
  const SmallPlan plan{.mishap = GetParam()};
  const auto walked = sights(plan, within(to_the_end));
  Bounds drawn = within(2'000);
  drawn.draw = 1;
  const auto seen = sights(plan, drawn);
  EXPECT_GT(seen.size(), 5U);
  for (const std::string& sight : seen) {
    EXPECT_TRUE(walked.contains(sight)) << sight;
  }
}

INSTANTIATE_TEST_SUITE_P(Of, ARandomOrder,
                         testing::Values(Mishap::none, Mishap::instance_killed,
                                         Mishap::instance_drained, Mishap::link_cut,
                                         Mishap::link_silent, Mishap::program_reset),
                         [](const auto& tested) {
                           const auto named =
                               std::ranges::find(mishap_names, tested.param, &MishapName::mishap);
                           std::string name(named->name);
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace millrace::tests::simulation
