#include "tests/simulation/exhaustive/walk.hpp"

namespace millrace::tests::simulation {

Walk walk_through(const SmallPlan& plan, const Bounds& bounds) {
  Explorer explorer(bounds);
  Walk walk;
  do {
    explorer.begin();
    walk.violations = SmallPlant(explorer, plan).run();
  } while (walk.violations.empty() && explorer.next());
  walk.choices = explorer.choices();
  walk.states = explorer.states();
  walk.runs = explorer.runs();
  walk.complete = explorer.complete();
  return walk;
}

std::vector<std::string> retell(const SmallPlan& plan, Bounds bounds, const Walk& walk) {
  std::vector<std::string> lines;
  bounds.draw.reset();
  Explorer explorer(bounds);
  explorer.repeat(walk.choices);
  explorer.begin();
  SmallPlant(explorer, plan, [&](const std::string& line) { lines.push_back(line); }).run();
  return lines;
}

std::set<std::string> sights(const SmallPlan& plan, const Bounds& bounds) {
  std::set<std::string> seen;
  Explorer explorer(bounds);
  do {
    explorer.begin();
    SmallPlant plant(explorer, plan);
    explorer.on_new_choice = [&] { seen.insert(plant.sight()); };
    plant.run();
  } while (explorer.next());
  return seen;
}

}  // namespace millrace::tests::simulation
