// Notices changes of files that a service runs by: its configuration, programs, secrets. Pure but
// for fingerprint().
//
//   Settle settle(500ms, fingerprint({file}), now);
//   if (settle.look(fingerprint({file}), now)) reload();
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace millrace::services::sdk {

/// Changes when one of the files changes: time, size, mode, place on the disk or existence.
std::string fingerprint(const std::vector<std::filesystem::path>& files);

// Debounces changes: a change counts once nothing has changed for a while, so that a file that is
// being written, or a folder that is being copied, is not read half.

class Settle {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// `state` represents what is watched: two states are equal if nothing changed between them.
  Settle(std::chrono::milliseconds quiet, std::string state, Time now)
      : quiet_(quiet), taken_(state), seen_(std::move(state)), since_(now) {}

  /// True once per change: `state` differs from the last accepted one and has not changed for
  /// `quiet`.
  bool look(const std::string& state, Time now);

 private:
  std::chrono::milliseconds quiet_;
  std::string taken_;
  std::string seen_;
  Time since_;
};

}  // namespace millrace::services::sdk
