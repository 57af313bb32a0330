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
// A run that comes to a state already seen is not followed any further. A state is: what each party
// has come to, what is on its way, and what those who judge remember. What a party has come to is
// what it says of itself, if somebody describes it, and else all that has happened to it.
//
// With Bounds::draw each run takes any order, to its end: whatever such runs come to, a walk must
// have seen.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "tests/simulation/time/agenda.hpp"
#include "tests/simulation/time/random.hpp"

namespace millrace::tests::simulation {

struct Bounds {
  /// So often a timer fires although something else could still happen before it.
  unsigned early_timers = 1;
  /// Timers this close to the first one count as due together.
  Time together{};
  /// Gives up after so many runs.
  std::size_t most_runs = 1'000'000;
  /// Takes any order, drawn from this seed, each run to its end.
  std::optional<std::uint64_t> draw{};
};

class Explorer final : public Order {
 public:
  explicit Explorer(Bounds bounds) : bounds_(bounds), random_(bounds.draw.value_or(0)) {}

  void begin();
  /// Until now everything has happened in its time; from now on, in every order.
  void start() { started_ = true; }
  /// False when all has been seen, or the bound is reached.
  bool next();
  /// Nothing is left.
  [[nodiscard]] bool complete() const { return path_.empty(); }
  /// In this run `party` says of itself what it has come to.
  void describe(Party party, std::function<Meaning()> words) {
    described_.at(party) = std::move(words);
    changed_ |= std::uint64_t{1} << party;
  }
  /// Called wherever there is a choice that was not made before.
  std::function<void()> on_new_choice = [] {};

  /// The run is in a state that was followed before.
  [[nodiscard]] bool known() const { return known_; }
  [[nodiscard]] std::size_t states() const { return states_.size(); }
  [[nodiscard]] std::size_t runs() const { return runs_; }
  /// Repeats these choices, then takes the first of each.
  void repeat(const std::vector<std::size_t>& choices);
  [[nodiscard]] std::vector<std::size_t> choices() const;

  std::optional<std::size_t> choose(const std::vector<Happening>& waiting, Time now) override;
  void happens(const Happening& happening) override;
  void touches(std::uint64_t parties) override;
  void becomes(std::uint64_t parties, Meaning meaning) override;
  void remembers(Meaning fact) override { now_.judged += repeating_ ? 0 : fact; }
  [[nodiscard]] bool watches() const override { return !repeating_; }
  void happened() override;
  void planned(const Happening& happening, std::optional<Meaning> means) override;

 private:
  static constexpr std::size_t most_parties = 64;

  /// What tells a state from others.
  struct Marks {
    /// What each party has come to.
    std::array<Meaning, most_parties> parties{};
    /// A sum, as the order of facts that have nothing to do with each other makes no difference.
    Meaning judged = 0;
    /// Of what is on its way, by its number: what brought it about, or what it means.
    std::unordered_map<std::uint64_t, Meaning> causes;
  };
  struct Choice {
    std::size_t taken = 0;
    std::size_t of = 1;
    /// Which of those that wait they are, and what was known then; not if only repeated.
    std::vector<std::size_t> found{};
    Marks before{};
  };

  [[nodiscard]] std::vector<std::size_t> candidates(const std::vector<Happening>& waiting) const;
  [[nodiscard]] Meaning cause_of(const Happening& one) const;
  [[nodiscard]] Meaning state(const std::vector<Happening>& waiting) const;
  void sort(std::vector<std::size_t>& found, const std::vector<Happening>& waiting) const;
  /// One of several; nothing if the state was followed before.
  std::optional<std::size_t> pick(std::vector<std::size_t> found,
                                  const std::vector<Happening>& waiting);

  Bounds bounds_;
  Random random_;
  std::vector<Choice> path_;
  std::size_t depth_ = 0;
  std::unordered_set<std::uint64_t> states_;
  std::size_t runs_ = 0;
  bool known_ = false;
  bool started_ = false;
  bool repeating_ = false;
  unsigned early_ = 0;
  Marks now_;
  std::array<std::function<Meaning()>, most_parties> described_;
  /// The parties that have changed in this event.
  std::uint64_t changed_ = 0;
  /// What happens now.
  Meaning current_ = 0;
  std::uint64_t planned_ = 0;
};

}  // namespace millrace::tests::simulation
