// The interpolator cycle: calls a function periodically while there is work, and sleeps otherwise.
//
//   Cycle cycle(executor, std::chrono::milliseconds(1),
//               [&](auto now) { … return machine.active(); });
//   cycle.wake();   // an NC program was started
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

namespace millrace::cnc::simulator {

/// How punctual the cycles were.
struct CycleCounts {
  std::uint64_t done = 0;
  /// Cycles that began at least one whole period late.
  std::uint64_t late = 0;
  /// The longest delay of a cycle.
  std::chrono::nanoseconds worst{0};
};

/// Cycles begin at multiples of the period since the clock's epoch, so that others can be
/// synchronous with them. Runs on the one executor; not thread-safe. Stop it before you destroy it
/// if its executor still runs.
class Cycle {
 public:
  /// Receives the time of the steady clock; false lets the cycle sleep until the next wake().
  using Work = std::function<bool(std::chrono::nanoseconds)>;

  Cycle(const boost::asio::any_io_executor& executor, std::chrono::nanoseconds period, Work work);

  /// Starts the cycles if they sleep.
  void wake();
  void stop();
  [[nodiscard]] const CycleCounts& counts() const { return counts_; }

 private:
  [[nodiscard]] std::chrono::steady_clock::time_point next_cycle(
      std::chrono::steady_clock::time_point now) const;
  void wait();
  void run();
  void count(std::chrono::nanoseconds delay);

  boost::asio::steady_timer timer_;
  std::chrono::nanoseconds period_;
  Work work_;
  CycleCounts counts_;
  bool awake_ = false;
};

}  // namespace millrace::cnc::simulator
