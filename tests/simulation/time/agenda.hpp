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
#include <vector>

namespace millrace::tests::simulation {

using namespace std::chrono_literals;

/// Since the simulation began.
using Time = std::chrono::nanoseconds;

/// Who an event concerns: a process, or what it has laid out for others to fetch (its outbox).
/// Whatever a party does follows from what happened to it before: an event changes its own parties
/// only, and those it says it touches, and reads those and `reads`.
using Party = std::uint8_t;

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
  /// Of what brought it about; equal only if that was equal.
  std::uint64_t cause = 0;
  std::function<void()> act;
};

struct Plan {
  std::uint64_t parties = 0;
  std::uint64_t reads = 0;
  bool timer = false;
  std::uint32_t lane = 0;
};

/// Which of the things that may happen next does. The default takes them in their time.
class Order {
 public:
  virtual ~Order() = default;
  /// Index into `waiting`, which is a heap by time; nothing if all is over.
  virtual std::optional<std::size_t> choose(const std::vector<Happening>& waiting, Time now) = 0;
  /// What has been chosen is about to happen.
  virtual void happens(const Happening& /*happening*/) {}
  /// What happens now changes these parties too.
  virtual void touches(std::uint64_t /*parties*/) {}
  /// The cause of whatever is planned now.
  virtual std::uint64_t cause() { return 0; }
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
  /// Lets one thing happen; false if there is none.
  bool step();
  [[nodiscard]] std::size_t size() const { return waiting_.size(); }

 private:
  Order* order_;
  Time now_{};
  std::uint64_t planned_ = 0;
  std::vector<Happening> waiting_;
};

}  // namespace millrace::tests::simulation
