// One channel, one gateway, two instances of a service, and one mishap at any moment.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tests/simulation/exhaustive/explorer.hpp"
#include "tests/simulation/gateway/gateway_process.hpp"
#include "tests/simulation/service/service_process.hpp"

namespace millrace::tests::simulation {

enum class Mishap : std::uint8_t {
  none,
  gateway_killed,
  gateway_power_cut,
  instance_killed,
  instance_drained,
  link_cut,
  /// The link carries nothing for a while, and neither side notices.
  link_silent,
  program_reset,
};

struct MishapName {
  Mishap mishap;
  std::string_view name;
};

inline constexpr std::array mishap_names{
    MishapName{Mishap::none, "nothing"},
    MishapName{Mishap::gateway_killed, "gateway-killed"},
    MishapName{Mishap::gateway_power_cut, "gateway-power-cut"},
    MishapName{Mishap::instance_killed, "instance-killed"},
    MishapName{Mishap::instance_drained, "instance-drained"},
    MishapName{Mishap::link_cut, "link-cut"},
    MishapName{Mishap::link_silent, "link-silent"},
    MishapName{Mishap::program_reset, "program-reset"},
};

struct SmallPlan {
  Mishap mishap = Mishap::none;
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  fabric::CompletionSignal completion_signal = fabric::CompletionSignal::response_state;
  cnc::simulator::ServiceRules rules{};
  /// Whether a controller executes what it has received on a connection that is gone.
  bool leftovers_dropped = false;
  std::size_t calls = 1;
  WriteBehaviour writes{};
  Bug bug = Bug::none;
};

class SmallPlant {
 public:
  SmallPlant(Explorer& explorer, const SmallPlan& plan, History::Trace trace = {});

  /// Runs until the program has finished and no call is open, or until the explorer ends it;
  /// returns the violations.
  std::vector<std::string> run();
  /// A description for people; it does not distinguish all states.
  [[nodiscard]] std::string sight() const;

 private:
  void describe();
  void inject();
  [[nodiscard]] std::uint64_t struck() const;
  void restart(const std::function<void()>& start);
  [[nodiscard]] bool done() const;

  SmallPlan plan_;
  Explorer& explorer_;
  Agenda agenda_;
  History history_;
  Fabric fabric_;
  LinkConditions conditions_;
  Controller controller_;
  GatewayProcess gateway_;
  ServiceProcess first_;
  /// Gets the call, so the mishap hits this one.
  ServiceProcess second_;
  bool struck_ = false;
};

// A walk through the orders of one small plant, and its result.
//
//   const Walk walk = walk_through({.mishap = Mishap::link_cut}, {.early_timers = 0});
//   if (!walk.violations.empty()) { for (auto& line : retell(plan, bounds, walk)) … }

struct Walk {
  /// Violations in the first run that has any; the walk ends there.
  std::vector<std::string> violations;
  /// The choices of the last run.
  std::vector<std::size_t> choices;
  std::size_t states = 0;
  std::size_t runs = 0;
  /// All orders were taken.
  bool complete = false;
};

Walk walk_through(const SmallPlan& plan, const Bounds& bounds);

/// The trace of the walk's last run.
std::vector<std::string> retell(const SmallPlan& plan, Bounds bounds, const Walk& walk);

/// All sights (SmallPlant::sight) at points where several events are possible: of a walk, or of
/// that many runs in random orders, which do not stop at known states.
std::set<std::string> sights(const SmallPlan& plan, const Bounds& bounds);

}  // namespace millrace::tests::simulation
