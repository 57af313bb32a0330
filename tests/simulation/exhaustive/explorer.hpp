// Walks every order in which the events of a small plant can happen: depth first, each run from the
// beginning with one choice changed.
//
//   Explorer explorer({.early_timers = 2});
//   do {
//     explorer.begin();
//     SmallPlant plant(explorer, …);
//     plant.run();                       // calls explorer.start()
//   } while (explorer.next());
//
// Whatever a party does follows from what happened to it before, so two runs in which the same has
// happened to each party are in the same state, and the second is not followed any further. That
// leaves out only orders of events that do not touch each other.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <unordered_set>
#include <vector>

#include "tests/simulation/time/agenda.hpp"

namespace millrace::tests::simulation {

struct Bounds {
  /// So often a timer fires although something else could still happen before it.
  unsigned early_timers = 1;
  /// Timers this close to the first one count as due together.
  Time together{};
  /// Gives up after so many runs.
  std::size_t most_runs = 1'000'000;
};

class Explorer final : public Order {
 public:
  explicit Explorer(Bounds bounds) : bounds_(bounds) {}

  void begin();
  /// Until now everything has happened in its time; from now on, in every order.
  void start() { started_ = true; }
  /// False when all has been seen, or the bound is reached.
  bool next();
  /// Nothing is left.
  [[nodiscard]] bool complete() const { return path_.empty(); }

  /// The run is in a state that was followed before.
  [[nodiscard]] bool known() const { return known_; }
  [[nodiscard]] std::size_t states() const { return states_.size(); }
  [[nodiscard]] std::size_t runs() const { return runs_; }
  /// Repeats these choices, then takes the first of each.
  void repeat(std::vector<std::size_t> choices);
  [[nodiscard]] std::vector<std::size_t> choices() const;

  std::optional<std::size_t> choose(const std::vector<Happening>& waiting, Time now) override;
  void happens(const Happening& happening) override;
  void touches(std::uint64_t parties) override;
  void becomes(std::uint64_t parties, Meaning meaning) override;
  Meaning cause() override;

 private:
  struct Choice {
    std::size_t taken = 0;
    std::size_t of = 1;
  };

  [[nodiscard]] std::vector<std::size_t> candidates(const std::vector<Happening>& waiting) const;
  [[nodiscard]] std::uint64_t state() const;

  static constexpr std::size_t most_parties = 64;

  Bounds bounds_;
  std::vector<Choice> path_;
  std::size_t depth_ = 0;
  std::unordered_set<std::uint64_t> states_;
  std::size_t runs_ = 0;
  bool known_ = false;
  bool started_ = false;
  unsigned early_ = 0;
  /// What has happened to each party, as a hash.
  std::array<std::uint64_t, most_parties> parties_{};
  std::uint64_t current_ = 0;
  std::uint64_t planned_ = 0;
};

}  // namespace millrace::tests::simulation
