// A walk through the orders of one small plant, and what it has found.
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
  /// Of the first run that broke a promise; it was the last.
  std::vector<std::string> violations;
  /// Those of the last run.
  std::vector<std::size_t> choices;
  std::size_t states = 0;
  std::size_t runs = 0;
  /// There is no other order.
  bool complete = false;
};

Walk walk_through(const SmallPlan& plan, const Bounds& bounds);

/// The last run of the walk, line by line.
std::vector<std::string> retell(const SmallPlan& plan, Bounds bounds, const Walk& walk);

/// All that can be seen of the plant (SmallPlant::sight) wherever several things could happen next:
/// by a walk, or by so many runs in orders drawn from a seed, which leave no state out.
std::set<std::string> sights(const SmallPlan& plan, const Bounds& bounds);

}  // namespace millrace::tests::simulation
