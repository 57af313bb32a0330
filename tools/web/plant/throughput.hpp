// Number of calls, of failures, and durations over the last seconds. Pure.
//
//   throughput.add(now, call.duration(), call_failed);
//   throughput.figures(now, begun).per_second
#pragma once

#include <chrono>
#include <deque>
#include <optional>
#include <vector>

#include "fabric/moment.hpp"

namespace millrace::tools::web::plant {

/// The value that `share` of the values do not exceed. Reorders them; needs at least one.
std::chrono::nanoseconds percentile(std::vector<std::chrono::nanoseconds>& values, double share);

struct Figures {
  double per_second = 0;
  /// Failed calls of the last minute: a shorter window would make many a minute of a single one.
  std::size_t errors_last_minute = 0;
  /// Nothing without a call of known duration.
  std::optional<std::chrono::nanoseconds> p50{};
  std::optional<std::chrono::nanoseconds> p99{};
  std::optional<std::chrono::nanoseconds> mean{};
};

/// Of one channel, one instance, one service, or all together.
class Throughput {
 public:
  /// Limit of remembered calls; more than any service handles within the window.
  static constexpr std::size_t most = 100'000;

  /// Calls older than `window` do not count.
  explicit Throughput(std::chrono::nanoseconds window = std::chrono::seconds(10))
      : window_(window) {}

  void add(fabric::SteadyTime now, std::optional<std::chrono::nanoseconds> duration, bool failed);
  /// Per second of the window, or since `begun` if that is shorter, when the first of all calls was
  /// counted: a new instance does not add to the sum before those that it relieves are slower.
  [[nodiscard]] Figures figures(fabric::SteadyTime now, fabric::SteadyTime begun) const;
  /// Whether a call is in the window, or a failed one in the last minute.
  [[nodiscard]] bool is_moving(fabric::SteadyTime now) const;

 private:
  struct One {
    fabric::SteadyTime at;
    std::optional<std::chrono::nanoseconds> duration;
    bool failed = false;
  };

  std::chrono::nanoseconds window_;
  std::deque<One> recent_;
  /// When calls of the last minute failed.
  std::deque<fabric::SteadyTime> errors_;
  /// Earlier calls were forgotten, since there were too many.
  std::optional<fabric::SteadyTime> complete_since_;
};

}  // namespace millrace::tools::web::plant
