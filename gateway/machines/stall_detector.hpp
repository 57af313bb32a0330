// Notices that this process stood still (SIGSTOP, a host that sleeps) for so long that others may
// have taken it for gone: its lease was renewed last up to 0.8 of its time before (Cyclone). Pure.
//
//   timer.expires_at(stall.beat(now));              // then beat() again
//   if (const auto late = stall.late(now)) …        // before anything else is done
#pragma once

#include <chrono>
#include <optional>

#include "gateway/moment.hpp"

namespace millrace::gateway::machines {

class StallDetector {
 public:
  /// `lease` of this process on the fabric.
  explicit StallDetector(std::chrono::nanoseconds lease) : period_(lease / 4) {}

  /// It lives; when to beat next.
  SteadyTime beat(SteadyTime now) {
    due_ = now + period_;
    return *due_;
  }
  /// It stood still and nobody has asked for how long; never before it has begun to beat.
  [[nodiscard]] bool overdue(SteadyTime now) const { return due_ && now - *due_ > period_; }
  /// For how long it stood still, once for each time; nothing if it did not.
  std::optional<std::chrono::nanoseconds> late(SteadyTime now) {
    if (!overdue(now)) {
      return std::nullopt;
    }
    const auto late = now - *due_;
    due_ = now;
    return late;
  }

 private:
  std::chrono::nanoseconds period_;
  std::optional<SteadyTime> due_;
};

}  // namespace millrace::gateway::machines
