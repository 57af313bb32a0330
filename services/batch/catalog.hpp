// Decides which scripts are served, and what changes when that changes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "services/batch/config.hpp"

namespace millrace::services::batch {

/// The steps to serve `after` in place of `before`.
struct Changes {
  /// UUIDs to remove from the fabric after their running calls.
  std::vector<std::string> stop;
  /// Scripts to register, after the stops (a script with a changed announcement is in both).
  std::vector<Script> start;
  /// Scripts with the same announcement that run differently from the next call on.
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

}  // namespace millrace::services::batch
