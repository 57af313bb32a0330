// How long to wait before the next attempt to reach a controller.
//
//   BackOff back_off(seed);
//   co_await sleep(back_off.next());       // 0.1 s, 0.2 s … 3 s, each 25 % more or less
//   back_off.reset();                      // it worked
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <random>

namespace millrace::gateway::machines {

/// The jitter keeps gateways that lost one controller together from coming back together.
class BackOff {
 public:
  explicit BackOff(std::uint32_t seed) : random_(seed) {}

  [[nodiscard]] std::chrono::milliseconds next() {
    std::uniform_int_distribution<std::int64_t> percent(75, 125);
    const auto wait = wait_ * percent(random_) / 100;
    wait_ = std::min(wait_ * 2, longest);
    return wait;
  }
  void reset() { wait_ = shortest; }

  static constexpr std::chrono::milliseconds shortest{100};
  static constexpr std::chrono::milliseconds longest{3000};

 private:
  std::minstd_rand random_;
  std::chrono::milliseconds wait_ = shortest;
};

}  // namespace millrace::gateway::machines
