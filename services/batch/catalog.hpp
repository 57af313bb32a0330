// Decides which scripts are served, and what changes when that changes.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "services/batch/config.hpp"

namespace millrace::services::batch {

/// The steps to serve `after` in place of `before`.
struct Changes {
  /// UUIDs to remove from the fabric after their running calls.
  std::vector<std::string> stop;
  /// Scripts to register, after the stops (a script with a changed registration is in both).
  std::vector<Script> start;
  /// Scripts with the same registration that run differently from the next call on.
  std::vector<Script> update;
};

Changes changes(const std::vector<Script>& before, const std::vector<Script>& after);

/// The scripts whose file exists and is executable for this process.
std::vector<Script> present(const std::vector<Script>& scripts);
std::vector<Script> absent(const std::vector<Script>& scripts);
/// What is wrong with an absent script, and its consequence; for people.
std::string absence_of(const Script& script);

/// Changes when one of the files changes: time, size, mode, place on the disk or existence.
std::string fingerprint(const std::filesystem::path& config, const std::vector<Script>& scripts);

// Debounces changes: a change counts once nothing has changed for a while, so that a file that is
// being written, or a folder that is being copied, is not read half.
//
//   Settle sut(500ms, state_now, now);
//   if (sut.look(state_now, now)) reload();

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
