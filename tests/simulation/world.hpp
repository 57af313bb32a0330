// A whole plant in one thread and virtual time: controllers with their programs, gateways, services
// and the links between them. The seed determines its parts and their faults.
//
//   World world(17, {});
//   const Outcome outcome = world.run();
//   for (const std::string& violation : outcome.violations) …
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/simulation/faults/fault_injector.hpp"
#include "tests/simulation/plant.hpp"
#include "tests/simulation/values/value_user.hpp"

namespace millrace::tests::simulation {

struct Options {
  Bug bug = Bug::none;
  History::Trace trace{};
  Limits limits{};
};

struct Outcome {
  std::vector<std::string> violations;
  /// Virtual time.
  Time took{};
  std::size_t answered = 0;
  /// How long faults lasted.
  Time faults_for{};
  FaultInjector::Coverage coverage{};
};

/// The command that repeats a simulation.
std::string replay(std::uint64_t seed, Bug bug, const Limits& limits = {});

class World {
 public:
  World(std::uint64_t seed, Options options);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  Outcome run();
  /// The names that Limits::quiet may contain.
  [[nodiscard]] std::vector<std::string> programs() const { return plant_.programs(); }

 private:
  void operate();
  void rescue();
  void supervise();
  void watch_the_serving();
  [[nodiscard]] bool done();
  void judge_the_end();

  /// The seed and the mistake.
  std::uint64_t seed_;
  Bug bug_;
  Limits limits_;
  Random random_;
  Agenda agenda_;
  History history_;
  Plant plant_;
  std::unique_ptr<FaultInjector> faults_;
  std::optional<ValueUser> value_user_;
  bool calm_ = false;
  /// Since when two gateways serve a channel although they hear each other.
  std::map<Key, Time> both_since_;
};

}  // namespace millrace::tests::simulation
