// Counts durations so that percentiles come out within 1 % without keeping each value.
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

namespace millrace::tools::recording {

/// Buckets grow with the value: 64 per power of two, so a value is known to 1/64.
class Histogram {
 public:
  using Duration = std::chrono::nanoseconds;

  /// Negative values (clocks of two hosts that differ) count as 0.
  void add(Duration value);
  void add(const Histogram& other);

  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] Duration max() const { return max_; }
  /// Zero if there is no value.
  [[nodiscard]] Duration mean() const;
  /// The value that `share` (0 to 1) of all values do not exceed; zero if there is none.
  [[nodiscard]] Duration percentile(double share) const;

 private:
  static std::size_t bucket_of(std::uint64_t value);
  /// The largest value of a bucket.
  static std::uint64_t top_of(std::size_t bucket);

  std::vector<std::uint64_t> buckets_;
  std::uint64_t count_ = 0;
  double sum_ = 0;
  Duration max_{};
};

}  // namespace millrace::tools::recording
