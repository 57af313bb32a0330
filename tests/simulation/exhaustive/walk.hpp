// A walk through the orders of one small plant, and its result.
//
//   const Walk walk = walk_through({.mishap = Mishap::link_cut}, {.early_timers = 0});
//   if (!walk.violations.empty()) { for (auto& line : retell(plan, bounds, walk)) … }
#pragma once

#include <set>
#include <string>
#include <vector>

#include "tests/simulation/exhaustive/small_plant.hpp"

namespace millrace::tests::simulation {

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
