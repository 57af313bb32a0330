// The timers of #TIMER: 128 of them, shared by all channels of a controller
// (IB/tf5200_programming_manual/207464587, documented).
//
//   auto timers = std::make_shared<Timers>();
//   Channel first(options, timers), second(options, timers);
//
// Pure: the caller passes the time. All channels that share timers must use the same time origin
// for their ticks.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

namespace millrace::cnc::nc {

class Timers {
 public:
  using Time = std::chrono::nanoseconds;
  static constexpr std::size_t count = 128;

  /// A restarted timer continues from its time (our choice: the documentation only states that it
  /// runs).
  void start(std::size_t id, Time now) {
    Timer& timer = timers_.at(id);
    timer.running_since = timer.running_since.value_or(now);
  }
  void stop(std::size_t id, Time now) {
    Timer& timer = timers_.at(id);
    timer.elapsed = timer.total(now);
    timer.running_since.reset();
  }
  /// Stops and zeroes the timer; the latched value stays until the next read.
  void clear(std::size_t id) {
    Timer& timer = timers_.at(id);
    timer.elapsed = Time{};
    timer.running_since.reset();
  }
  /// Latches the timer's milliseconds for V.G.TIMER[id].
  void read(std::size_t id, Time now) {
    Timer& timer = timers_.at(id);
    const auto total = std::chrono::floor<std::chrono::milliseconds>(timer.total(now)).count();
    // 32 bits are enough for 1193 hours.
    timer.latched = static_cast<std::uint32_t>(
        std::clamp<std::int64_t>(total, 0, std::numeric_limits<std::uint32_t>::max()));
  }
  /// V.G.TIMER[id]: the milliseconds at the last read.
  [[nodiscard]] std::uint32_t latched(std::size_t id) const { return timers_.at(id).latched; }

 private:
  struct Timer {
    /// Running time before `running_since`.
    Time elapsed{};
    std::optional<Time> running_since;
    std::uint32_t latched = 0;

    [[nodiscard]] Time total(Time now) const {
      return elapsed + (running_since ? now - *running_since : Time{});
    }
  };
  std::array<Timer, count> timers_;
};

}  // namespace millrace::cnc::nc
