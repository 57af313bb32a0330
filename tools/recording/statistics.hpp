// Numbers of events: percentiles of durations, and frequencies. Pure.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "fabric/messages.hpp"

namespace millrace::tools::recording {

// Counts durations so that percentiles come out within 1 % without keeping each value.

/// Buckets grow with the value: 64 per power of two, so a value is known to 1/64.
class Histogram {
 public:
  using Duration = std::chrono::nanoseconds;

  /// Negative values (clocks of two hosts that differ) count as 0.
  void add(Duration value);

  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] Duration max() const { return max_; }
  /// The value that `share` (0 to 1) of all values do not exceed; zero if there is none.
  [[nodiscard]] Duration percentile(double share) const;

 private:
  static std::size_t bucket_of(std::uint64_t value);
  /// The largest value of a bucket.
  static std::uint64_t top_of(std::size_t bucket);

  std::vector<std::uint64_t> buckets_;
  std::uint64_t count_ = 0;
  Duration max_{};
};

// The frequency of an event over the last seconds. Pure.

/// Of one channel or service.
class Rate {
 public:
  /// Older events do not count.
  static constexpr std::chrono::seconds window{10};

  /// Something that took `duration` (none = not known) ended at `now`.
  void add(fabric::Time now, std::optional<std::chrono::nanoseconds> duration);

  /// Since the start.
  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// Over the window, or since the first time if that is less ago.
  [[nodiscard]] double per_second(fabric::Time now) const;
  /// Of the durations in the window; none if there is none.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> mean(fabric::Time now) const;

 private:
  struct One {
    fabric::Time at;
    std::optional<std::chrono::nanoseconds> duration;
  };

  std::deque<One> recent_;
  fabric::Time first_{};
  std::uint64_t count_ = 0;
};

}  // namespace millrace::tools::recording
