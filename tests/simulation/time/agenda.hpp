// Virtual time: planned events, in the order in which they happen. One thread, no clock.
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

/// What an event concerns: a process, or the samples that it offers to others (its outbox). A
/// party's actions follow from its past: an event changes only its own parties and those it touches
/// explicitly, and reads only those and `reads`.
using Party = std::uint8_t;

/// A state as a number: equal numbers mean equal states.
using Meaning = std::uint64_t;

/// For values with a std::hash.
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

/// The runs of one process or two: nothing happens once one of them is over.
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

struct NcEvent {
  Time at{};
  /// Orders events at the same time, and counts all that were ever planned.
  std::uint64_t number = 0;
  /// Bits of the parties it changes, and of those that it only reads.
  std::uint64_t parties = 0;
  std::uint64_t reads = 0;
  /// A timer of its party, which may fire late; all other events arrive.
  bool timer = false;
  /// Events on one lane keep their order; 0 = no lane.
  std::uint32_t lane = 0;
  /// The runs of the processes it was planned in, which may be over.
  Lives lives{};
  std::function<void()> act;
};

struct Plan {
  std::uint64_t parties = 0;
  std::uint64_t reads = 0;
  bool timer = false;
  std::uint32_t lane = 0;
  /// Replaces the cause of the event in comparisons of states.
  std::optional<Meaning> means{};
  Lives lives{};
};

/// Chooses the next event. By default the one that is due first.
class Order {
 public:
  virtual ~Order() = default;
  /// Index into `waiting`, which has no order; nothing if all is over.
  virtual std::optional<std::size_t> choose(const std::vector<NcEvent>& waiting, Time now) = 0;
  /// The chosen event is about to happen.
  virtual void happens(const NcEvent& /*happening*/) {}
  /// The current event changes these parties too.
  virtual void touches(std::uint64_t /*parties*/) {}
  /// From now on `meaning` is the whole state of these parties.
  virtual void becomes(std::uint64_t /*parties*/, Meaning /*meaning*/) {}
  /// A fact that checks will remember, also when its party is gone.
  virtual void remembers(Meaning /*fact*/) {}
  /// It needs the states of parties.
  [[nodiscard]] virtual bool watches() const { return true; }
  /// The current event has happened.
  virtual void happened() {}
  /// An event is planned. Its cause does not matter if its meaning is given.
  virtual void planned(const NcEvent& /*happening*/, std::optional<Meaning> /*means*/) {}
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
  /// Whether all orders are tried, which needs the states of parties.
  [[nodiscard]] bool watched() const { return order_ != nullptr && order_->watches(); }
  void remembers(Meaning fact) {
    if (order_ != nullptr) {
      order_->remembers(fact);
    }
  }
  /// The combined meaning of these; nothing unless all orders are tried.
  template <typename... Parts>
  [[nodiscard]] std::optional<Meaning> meaning(const Parts&... parts) const {
    return watched() ? std::optional(meaning_of(parts...)) : std::nullopt;
  }
  /// Lets one event happen; false if there is none.
  bool step();

 private:
  /// When an event happens, and where it is stored.
  struct Due {
    Time at{};
    std::uint64_t number = 0;
    std::size_t place = 0;
  };
  static bool later(const Due& a, const Due& b) {
    return a.at != b.at ? a.at > b.at : a.number > b.number;
  }
  void keep(NcEvent happening);
  /// Nothing if all is over.
  std::optional<NcEvent> take();

  Order* order_;
  Time now_{};
  std::uint64_t planned_ = 0;
  /// In no order. Without an Order, `due_` is a heap by time, and the place of a past event is
  /// reused by way of `free_`.
  std::vector<NcEvent> waiting_;
  std::vector<Due> due_;
  std::vector<std::size_t> free_;
};

}  // namespace millrace::tests::simulation
