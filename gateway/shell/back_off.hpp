// How long to wait before the next attempt to reach a controller.
//
//   BackOff back_off(seed);
//   co_await sleep(back_off.next(lasted));    // 0.1 s, 0.2 s … 3 s, each 25 % more or less
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <random>

namespace millrace::gateway::shell {

/// The jitter keeps gateways that lost one controller together from coming back together.
class BackOff {
 public:
  explicit BackOff(std::uint32_t seed) : random_(seed) {}

  /// `lasted`: for how long there was a link since the last wait; 0 if there was none. Where every
  /// link drops soon (another client uses this host's route, a controller that fails again and
  /// again) the waits grow as if there had been none.
  [[nodiscard]] std::chrono::milliseconds next(std::chrono::nanoseconds lasted) {
    if (lasted >= longest) {
      wait_ = shortest;
    }
    std::uniform_int_distribution<std::int64_t> percent(75, 125);
    const auto wait = wait_ * percent(random_) / 100;
    wait_ = std::min(wait_ * 2, longest);
    return wait;
  }

  static constexpr std::chrono::milliseconds shortest{100};
  static constexpr std::chrono::milliseconds longest{3000};

 private:
  std::minstd_rand random_;
  std::chrono::milliseconds wait_ = shortest;
};

}  // namespace millrace::gateway::shell
