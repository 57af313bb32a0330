// Sends heartbeats as long as the loop runs, and detects that it stood still (a hanging loop,
// SIGSTOP, a suspended host) for so long that others may have taken this process for gone. Pure.
//
//   timer.expires_at(stall.heartbeat(now));         // publish, then heartbeat() again
//   if (const auto overdue = stall.take_overdue(now)) …  // before anything else is done
#pragma once

#include <chrono>
#include <optional>

#include "gateway/moment.hpp"

namespace millrace::gateway::machines {

class StallDetector {
 public:
  /// Other processes take this one for gone after its `lease` without a heartbeat; several
  /// heartbeats may be lost. Cyclone renews the lease of a process, which a frozen one loses too,
  /// up to 0.8 of its time before; a return within half a lease after the last heartbeat is
  /// accepted nevertheless, for the sake of busy hosts.
  explicit StallDetector(std::chrono::nanoseconds lease)
      : period_(lease / 8), forgiven_(lease / 2 - period_) {}

  /// The process runs; returns when the next heartbeat is due.
  SteadyTime heartbeat(SteadyTime now) {
    due_ = now + period_;
    return *due_;
  }
  /// It stood still, and the length was not requested yet; never before its first heartbeat.
  [[nodiscard]] bool overdue(SteadyTime now) const { return due_ && now - *due_ > forgiven_; }
  /// For how long it stood still, once for each time; nothing if it did not.
  std::optional<std::chrono::nanoseconds> take_overdue(SteadyTime now) {
    if (!overdue(now)) {
      return std::nullopt;
    }
    const auto late = now - *due_;
    due_ = now;
    return late;
  }

 private:
  std::chrono::nanoseconds period_;
  std::chrono::nanoseconds forgiven_;
  std::optional<SteadyTime> due_;
};

}  // namespace millrace::gateway::machines
