// The source of all randomness in a simulation: one seed gives the same numbers everywhere.
//
//   Random random(17);
//   if (random.chance(5)) …                       // 5 in 100
//   const Time delay = random.between(1ms, 20ms);
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "tests/simulation/time/agenda.hpp"

namespace millrace::tests::simulation {

/// SplitMix64 (Steele, Lea, Flood: "Fast splittable pseudorandom number generators", 2014).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  /// Without randomness: every delay is the least, every toss of a coin has this outcome. For
  /// walks, which try all orders themselves.
  static Random still(std::uint64_t seed, bool toss) {
    Random random(seed);
    random.toss_ = toss;
    return random;
  }

  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15U);
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31U);
  }

  /// 0 to bound - 1.
  std::size_t below(std::size_t bound) {
    assert(bound > 0);
    if (toss_) {
      return 0;
    }
    return static_cast<std::size_t>(next() % bound);
  }
  /// True with this probability in percent.
  bool chance(unsigned percent) { return toss_ ? *toss_ && percent > 0 : below(100) < percent; }
  /// Both ends included.
  Time between(Time least, Time most) {
    const auto span = static_cast<std::size_t>((most - least).count()) + 1;
    return least + Time(static_cast<std::int64_t>(below(span)));
  }
  /// Mostly near `least`, sometimes as long as `most`: like the delays of networks and machines.
  Time mostly(Time least, Time usual, Time most, unsigned percent) {
    return chance(percent) ? between(usual, most) : between(least, usual);
  }
  template <typename Container>
  auto& pick(Container& items) {
    return items[below(items.size())];
  }
  /// The state of the generator.
  [[nodiscard]] std::uint64_t state() const { return state_; }
  /// A separate source, so that one part's draws do not shift another's.
  Random fork() {
    Random random(next());
    random.toss_ = toss_;
    return random;
  }

 private:
  std::uint64_t state_;
  std::optional<bool> toss_;
};

}  // namespace millrace::tests::simulation
