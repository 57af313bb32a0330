// Which programs are served, and what to do when that changes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "services/batch/script.hpp"

namespace millrace::services::batch {

/// What has to happen so that `after` is served instead of `before`.
struct Changes {
  /// UUIDs to take off the fabric, running calls finished.
  std::vector<std::string> stop;
  /// To put on the fabric, after the stops (a script that changed its registration is in both).
  std::vector<Script> start;
  /// Registered as before, but to be run differently from the next call on.
  std::vector<Script> update;
};

Changes changes(const std::vector<Script>& before, const std::vector<Script>& after);

/// The scripts whose program is there and executable for this process.
std::vector<Script> present(const std::vector<Script>& scripts);

/// Differs when one of the files changed: time, size, mode or place on the disk, or its being
/// there.
std::string fingerprint(const std::filesystem::path& config, const std::vector<Script>& scripts);

}  // namespace millrace::services::batch
