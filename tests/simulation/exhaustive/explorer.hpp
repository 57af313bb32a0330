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
// A run ends at a state that was seen before. A state consists of the state of each party, the
// events under way, and what the checks remember. The state of a party is its description, if it
// has one, otherwise its whole past.
//
// With Bounds::draw each run takes a random order to its end. A walk must have seen everything that
// such runs lead to.
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
  /// How many times a timer may fire before another event that is possible.
  unsigned early_timers = 1;
  /// Timers this close to the first one count as due together.
  Time together{};
  /// Gives up after this many runs.
  std::size_t most_runs = 1'000'000;
  /// Takes random orders, drawn from this seed, each run to its end.
  std::optional<std::uint64_t> draw{};
};

class Explorer final : public Order {
 public:
  explicit Explorer(Bounds bounds) : bounds_(bounds), random_(bounds.draw.value_or(0)) {}

  void begin();
  /// Until here events happen in the order of their times; from now on, in every order.
  void start() { started_ = true; }
  /// False when every order was taken, or the bound is reached.
  bool next();
  /// No order is left.
  [[nodiscard]] bool complete() const { return path_.empty(); }
  /// Describes the state of `party` in this run.
  void describe(Party party, std::function<Meaning()> words) {
    described_.at(party) = std::move(words);
    changed_ |= std::uint64_t{1} << party;
  }
  /// Called at each new choice.
  std::function<void()> on_new_choice = [] {};

  /// The run has come to a state that was seen before.
  [[nodiscard]] bool known() const { return known_; }
  [[nodiscard]] std::size_t states() const { return states_.size(); }
  [[nodiscard]] std::size_t runs() const { return runs_; }
  /// Repeats these choices, then always takes the first one.
  void repeat(const std::vector<std::size_t>& choices);
  [[nodiscard]] std::vector<std::size_t> choices() const;

  std::optional<std::size_t> choose(const std::vector<NcEvent>& waiting, Time now) override;
  void happens(const NcEvent& happening) override;
  void touches(std::uint64_t parties) override;
  void becomes(std::uint64_t parties, Meaning meaning) override;
  void remembers(Meaning fact) override { now_.judged += repeating_ ? 0 : fact; }
  [[nodiscard]] bool watches() const override { return !repeating_; }
  void happened() override;
  void planned(const NcEvent& happening, std::optional<Meaning> means) override;

 private:
  static constexpr std::size_t most_parties = 64;

  /// What distinguishes a state from others.
  struct Marks {
    /// The state of each party.
    std::array<Meaning, most_parties> parties{};
    /// What the checks remember. A sum, because the order of unrelated facts makes no difference.
    Meaning judged = 0;
    /// The cause or the meaning of each event under way, by its number.
    std::unordered_map<std::uint64_t, Meaning> causes;
  };
  struct Choice {
    std::size_t taken = 0;
    std::size_t of = 1;
    /// The waiting events to choose from, and the marks at that time; empty in a repeated run.
    std::vector<std::size_t> found{};
    Marks before{};
  };

  [[nodiscard]] std::vector<std::size_t> candidates(const std::vector<NcEvent>& waiting) const;
  [[nodiscard]] Meaning cause_of(const NcEvent& event) const;
  [[nodiscard]] Meaning state(const std::vector<NcEvent>& waiting) const;
  void sort(std::vector<std::size_t>& found, const std::vector<NcEvent>& waiting) const;
  /// Picks one of these events; nothing if the state was seen before.
  std::optional<std::size_t> pick(std::vector<std::size_t> found,
                                  const std::vector<NcEvent>& waiting);

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
  /// The cause of the current event.
  Meaning current_ = 0;
  std::uint64_t planned_ = 0;
};

}  // namespace millrace::tests::simulation
