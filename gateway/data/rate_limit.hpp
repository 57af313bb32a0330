// A limit of requests per second, with a small burst. Pure.
//
//   RateLimit limit(50, now);
//   if (limit.left(now) >= 1) { …; limit.spend(1); }
//   else wait_until(limit.time_of_one(now));
#pragma once

#include <algorithm>
#include <chrono>

#include "gateway/moment.hpp"

namespace millrace::gateway::data {

class RateLimit {
 public:
  /// At most the requests of a tenth of a second can be saved, and at least one.
  explicit RateLimit(double per_second) : per_second_(per_second), left_(most()) {}

  [[nodiscard]] double per_second() const { return per_second_; }

  /// The number of requests that are allowed now.
  double left(SteadyTime now) {
    const std::chrono::duration<double> passed = now - at_;
    if (passed.count() > 0) {
      left_ = std::min(left_ + passed.count() * per_second_, most());
      at_ = now;
    }
    return left_;
  }

  /// May lead into debt: what was sent was sent.
  void spend(double requests) { left_ -= requests; }
  /// The controller is overloaded: no request for a second.
  void empty() { left_ = std::min(left_, 0.0) - per_second_; }

  /// When one request may be sent.
  SteadyTime time_of_one(SteadyTime now) {
    const double missing = 1 - left(now);
    if (missing <= 0) {
      return now;
    }
    const std::chrono::duration<double> wait(missing / per_second_);
    // Rounded up, so that there is one then.
    return now + std::chrono::ceil<std::chrono::milliseconds>(wait);
  }

 private:
  [[nodiscard]] double most() const { return std::max(per_second_ / 10, 1.0); }

  double per_second_;
  double left_;
  SteadyTime at_{};
};

}  // namespace millrace::gateway::data
