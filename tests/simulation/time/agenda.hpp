// Virtual time: what is to happen, in the order in which it happens. One thread, no clock.
//
//   Agenda agenda;
//   agenda.at(agenda.now() + 5ms, [] { … });
//   while (agenda.step()) {}
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace millrace::tests::simulation {

using namespace std::chrono_literals;

/// Since the simulation began.
using Time = std::chrono::nanoseconds;

/// Who an event concerns: a process, or what it has laid out for others to fetch (its outbox).
/// Whatever a party does follows from what happened to it before: an event changes its own parties
/// only, and those it says it touches, and reads those and `reads`.
using Party = std::uint8_t;

/// What something comes to, as a number: equal only if it is equal.
using Meaning = std::uint64_t;

/// Of things that have a std::hash.
template <typename... Parts>
Meaning meaning_of(const Parts&... parts) {
  Meaning all = 0;
  const auto add = [&all](Meaning part) {
    // As boost::hash_combine does for 64 bits (splitmix64's finalizer).
    all += 0x9e3779b97f4a7c15U + part;
    all = (all ^ (all >> 30U)) * 0xbf58476d1ce4e5b9U;
    all = (all ^ (all >> 27U)) * 0x94d049bb133111ebU;
    all ^= all >> 31U;
  };
  const auto hash = []<typename Part>(const Part& part) -> Meaning {
    if constexpr (std::is_convertible_v<const Part&, std::string_view>) {
      return std::hash<std::string_view>{}(part);
    } else if constexpr (std::is_enum_v<Part>) {
      return static_cast<Meaning>(part);
    } else {
      return std::hash<Part>{}(part);
    }
  };
  (add(hash(parts)), ...);
  return all;
}

/// Of one process or two: nothing happens once one of them is over.
struct Lives {
  const std::uint64_t* first = nullptr;
  const std::uint64_t* second = nullptr;
  std::uint64_t first_planned_in = 0;
  std::uint64_t second_planned_in = 0;

  [[nodiscard]] bool over() const {
    return (first != nullptr && *first != first_planned_in) ||
           (second != nullptr && *second != second_planned_in);
  }
};

struct Happening {
  Time at{};
  /// Orders what happens at the same time, and counts what was ever planned.
  std::uint64_t number = 0;
  /// Bits of the parties it changes, and of those that it only reads.
  std::uint64_t parties = 0;
  std::uint64_t reads = 0;
  /// A timer of its party, which may fire late; everything else is on its way and arrives.
  bool timer = false;
  /// What a lane carries arrives in its order; 0 = no lane.
  std::uint32_t lane = 0;
  /// The lives of the processes it was planned in, which may be over.
  Lives lives{};
  std::function<void()> act;
};

struct Plan {
  std::uint64_t parties = 0;
  std::uint64_t reads = 0;
  bool timer = false;
  std::uint32_t lane = 0;
  /// Nothing else of what brought it about matters.
  std::optional<Meaning> means{};
  Lives lives{};
};

/// Which of the things that may happen next does. The default takes them in their time.
class Order {
 public:
  virtual ~Order() = default;
  /// Index into `waiting`, which is in no order; nothing if all is over.
  virtual std::optional<std::size_t> choose(const std::vector<Happening>& waiting, Time now) = 0;
  /// What has been chosen is about to happen.
  virtual void happens(const Happening& /*happening*/) {}
  /// What happens now changes these parties too.
  virtual void touches(std::uint64_t /*parties*/) {}
  /// From now on all that matters of these parties is this.
  virtual void becomes(std::uint64_t /*parties*/, Meaning /*meaning*/) {}
  /// Something that whoever judges will remember, also when the party that did it is gone.
  virtual void remembers(Meaning /*fact*/) {}
  /// It needs to know what things come to.
  [[nodiscard]] virtual bool watches() const { return true; }
  /// What was about to happen has happened.
  virtual void happened() {}
  /// This is on its way from now on. What brought it about does not matter if it is said what it
  /// means.
  virtual void planned(const Happening& /*happening*/, std::optional<Meaning> /*means*/) {}
};

class Agenda {
 public:
  explicit Agenda(Order* order = nullptr) : order_(order) {}

  [[nodiscard]] Time now() const { return now_; }
  void at(Time when, const Plan& plan, std::function<void()> act);
  void after(Time delay, const Plan& plan, std::function<void()> act) {
    at(now_ + delay, plan, std::move(act));
  }
  void touches(std::uint64_t parties) {
    if (order_ != nullptr) {
      order_->touches(parties);
    }
  }
  void becomes(std::uint64_t parties, Meaning meaning) {
    if (order_ != nullptr) {
      order_->becomes(parties, meaning);
    }
  }
  /// Whether somebody tries all orders, and needs to know what things come to.
  [[nodiscard]] bool watched() const { return order_ != nullptr && order_->watches(); }
  void remembers(Meaning fact) {
    if (order_ != nullptr) {
      order_->remembers(fact);
    }
  }
  /// What these come to, if somebody tries all orders.
  template <typename... Parts>
  [[nodiscard]] std::optional<Meaning> meaning(const Parts&... parts) const {
    return watched() ? std::optional(meaning_of(parts...)) : std::nullopt;
  }
  /// Lets one thing happen; false if there is none.
  bool step();

 private:
  /// When something happens, and where it is kept.
  struct Due {
    Time at{};
    std::uint64_t number = 0;
    std::size_t place = 0;
  };
  static bool later(const Due& a, const Due& b) {
    return a.at != b.at ? a.at > b.at : a.number > b.number;
  }
  void keep(Happening happening);
  /// Nothing if all is over.
  std::optional<Happening> take();

  Order* order_;
  Time now_{};
  std::uint64_t planned_ = 0;
  /// In no order. Without somebody who chooses, `due_` is a heap by time, and what has happened
  /// leaves its place in `free_` for another.
  std::vector<Happening> waiting_;
  std::vector<Due> due_;
  std::vector<std::size_t> free_;
};

}  // namespace millrace::tests::simulation
