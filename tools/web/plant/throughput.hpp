// How many calls end, how many of them fail, and how long they take: over the last seconds. Pure.
//
//   throughput.add(now, call.duration(), call_failed);
//   throughput.figures(now).per_second
#pragma once

#include <chrono>
#include <deque>
#include <optional>

#include "fabric/moment.hpp"

namespace millrace::tools::web::plant {

struct Figures {
  double per_second = 0;
  double errors_per_second = 0;
  /// None without a call whose duration is known.
  std::optional<std::chrono::nanoseconds> p50{};
  std::optional<std::chrono::nanoseconds> p99{};
  std::optional<std::chrono::nanoseconds> mean{};
};

/// Of one channel, one instance, one service, or all.
class Throughput {
 public:
  /// Of so many calls each one is remembered; more than that is more than anybody serves.
  static constexpr std::size_t most = 100'000;

  /// What is older than `window` counts no more.
  explicit Throughput(std::chrono::nanoseconds window = std::chrono::seconds(10))
      : window_(window) {}

  void add(fabric::SteadyTime now, std::optional<std::chrono::nanoseconds> duration, bool failed);
  /// Per second of the window, or of the time since the first call if that is less.
  [[nodiscard]] Figures figures(fabric::SteadyTime now) const;
  /// Whether a call is in the window.
  [[nodiscard]] bool is_moving(fabric::SteadyTime now) const;

 private:
  struct One {
    fabric::SteadyTime at;
    std::optional<std::chrono::nanoseconds> duration;
    bool failed = false;
  };

  std::chrono::nanoseconds window_;
  std::deque<One> recent_;
  std::optional<fabric::SteadyTime> first_;
};

}  // namespace millrace::tools::web::plant
