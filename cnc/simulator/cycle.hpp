// The interpolator cycle: calls a function at a fixed pace while there is something to do, and
// sleeps otherwise.
//
//   Cycle cycle(executor, std::chrono::milliseconds(1), [&](auto now) { … return machine.active();
//   }); cycle.wake();   // a program was started
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

namespace millrace::cnc::simulator {

/// How well the pace was kept.
struct CycleCounts {
  std::uint64_t done = 0;
  /// Begun at least one whole period after their time.
  std::uint64_t late = 0;
  /// The most a cycle was begun after its time.
  std::chrono::nanoseconds worst{0};
};

/// Beats at multiples of the period since the clock's beginning, so that others can keep in step.
/// Everything runs on the one executor; not thread-safe. Must be stopped before it is destroyed
/// while its executor still runs.
class Cycle {
 public:
  /// Is told the time of the steady clock; false lets the cycle sleep until the next wake().
  using Work = std::function<bool(std::chrono::nanoseconds)>;

  Cycle(const boost::asio::any_io_executor& executor, std::chrono::nanoseconds period, Work work);

  /// Starts the pace if it sleeps.
  void wake();
  void stop();
  [[nodiscard]] const CycleCounts& counts() const { return counts_; }

 private:
  [[nodiscard]] std::chrono::steady_clock::time_point next_beat(
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
