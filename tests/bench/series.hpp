// Times of one kind, and their quantiles.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace millrace::bench {

using Clock = std::chrono::steady_clock;

class Series {
 public:
  void add(Clock::duration time) {
    microseconds_.push_back(std::chrono::duration<double, std::micro>(time).count());
  }
  void add_microseconds(double time) { microseconds_.push_back(time); }
  void add(const Series& other) {
    microseconds_.insert(microseconds_.end(), other.microseconds_.begin(),
                         other.microseconds_.end());
  }
  [[nodiscard]] bool empty() const { return microseconds_.empty(); }
  [[nodiscard]] std::size_t size() const { return microseconds_.size(); }
  /// In microseconds; `share` from 0 to 1.
  double quantile(double share) {
    if (microseconds_.empty()) {
      return 0;
    }
    const auto place =
        static_cast<std::ptrdiff_t>(share * static_cast<double>(microseconds_.size() - 1));
    std::ranges::nth_element(microseconds_, microseconds_.begin() + place);
    return microseconds_[static_cast<std::size_t>(place)];
  }
  double median() { return quantile(0.5); }
  double p99() { return quantile(0.99); }

 private:
  std::vector<double> microseconds_;
};

/// "goal: at most 1.25, met"
inline std::string verdict(double value, double goal, bool at_most) {
  return fmt::format("goal: at {} {:g}, {}", at_most ? "most" : "least", goal,
                     (at_most ? value <= goal : value >= goal) ? "met" : "MISSED");
}

}  // namespace millrace::bench
