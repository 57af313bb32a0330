// The timers of #TIMER: 128 of them, shared by all channels of a controller
// (IB/tf5200_programming_manual/207464587, documented).
//
//   auto timers = std::make_shared<Timers>();
//   Channel first(options, timers), second(options, timers);
//
// Pure: the caller passes the time. All channels that share timers must use the same time origin
// for their ticks.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace millrace::cnc::nc {

class Timers {
 public:
  using Time = std::chrono::nanoseconds;
  static constexpr std::size_t count = 128;

  /// A restarted timer continues from its time (our choice: the documentation only states that it
  /// runs).
  void start(std::size_t id, Time now);
  void stop(std::size_t id, Time now);
  /// Stops and zeroes the timer; the latched value stays until the next read.
  void clear(std::size_t id);
  /// Latches the timer's milliseconds for V.G.TIMER[id].
  void read(std::size_t id, Time now);
  /// V.G.TIMER[id]: the milliseconds at the last read.
  [[nodiscard]] std::uint32_t latched(std::size_t id) const { return timers_.at(id).latched; }

 private:
  struct Timer {
    /// Running time before `running_since`.
    Time elapsed{};
    std::optional<Time> running_since;
    std::uint32_t latched = 0;
  };
  std::array<Timer, count> timers_;
};

}  // namespace millrace::cnc::nc
