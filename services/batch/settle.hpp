// Debounces changes: a change counts once nothing has changed for a while, so that a file that is
// being written, or a folder that is being copied, is not read half.
//
//   Settle sut(500ms, state_now, now);
//   if (sut.look(state_now, now)) reload();
#pragma once

#include <chrono>
#include <string>

namespace millrace::services::batch {

class Settle {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// `state` represents what is watched: two states are equal if nothing changed between them.
  Settle(std::chrono::milliseconds quiet, std::string state, Time now)
      : quiet_(quiet), taken_(state), seen_(std::move(state)), since_(now) {}

  /// True once per change: `state` differs from the last accepted one and has not changed for
  /// `quiet`.
  bool look(const std::string& state, Time now);

  /// For a configuration that changes its own settle time.
  void set_quiet(std::chrono::milliseconds quiet) { quiet_ = quiet; }

 private:
  std::chrono::milliseconds quiet_;
  std::string taken_;
  std::string seen_;
  Time since_;
};

}  // namespace millrace::services::batch
