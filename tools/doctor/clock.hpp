// By how much the clocks of two hosts differ, from stamps that they exchange. Pure.
//
// Two ways (as NTP does it, RFC 5905, 8): we ask at t0, the other answers with its time t, we hear
// it at t1, both by our clock. Its clock is ahead by t - (t0 + t1) / 2; the answer was given
// somewhere between t0 and t1, so the error is at most (t1 - t0) / 2. Of several exchanges the
// shortest counts.
#pragma once

#include <chrono>
#include <optional>

#include "fabric/messages.hpp"

namespace millrace::tools::doctor {

struct Exchange {
  fabric::Time asked{};
  /// By the other clock.
  fabric::Time answered{};
  fabric::Time received{};
};

struct ClockDifference {
  /// Positive: the other clock is ahead of this host's.
  std::chrono::nanoseconds ahead{};
  /// The true difference is within `ahead` ± `error`.
  std::chrono::nanoseconds error{};
};

class ClockComparison {
 public:
  void add(const Exchange& exchange) {
    const auto way = exchange.received - exchange.asked;
    if (way < std::chrono::nanoseconds::zero() || exchange.answered == fabric::Time{}) {
      return;  // Our own clock was set in between, or the other gives no time.
    }
    const auto error = way / 2;
    if (!best_ || error < best_->error) {
      best_ = ClockDifference{exchange.answered - (exchange.asked + error), error};
    }
  }
  /// None before the first exchange.
  [[nodiscard]] const std::optional<ClockDifference>& result() const { return best_; }

 private:
  std::optional<ClockDifference> best_;
};

}  // namespace millrace::tools::doctor
