// A folder of archive files: the newest is written, the others are closed and kept for a while.
//
//   Archive archive("/var/lib/millrace/archive", policy, now);
//   const auto ids = archive.append(rows, now);
//
// Functions throw SQLite::Exception or std::runtime_error when the folder or its files cannot be
// read or written.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/posix/fd.hpp"
#include "services/archiver/retention.hpp"
#include "services/archiver/segment.hpp"

namespace millrace::services::archiver {

class Archive {
 public:
  /// Makes the folder if it is not there. Throws also if another process writes it.
  Archive(std::filesystem::path folder, const Policy& policy, fabric::Time now);

  /// Adds all rows or none, durably; begins a new file before if it is time. Returns the id of each
  /// put, 0 for other rows. A put whose call is in this file or the one before has the id it had.
  std::vector<std::int64_t> append(std::vector<Row> rows, fabric::Time now);

  /// The file that is written.
  [[nodiscard]] std::filesystem::path file() const;

 private:
  void rotate(fabric::Time now);
  void remove_expired(fabric::Time now);

  std::filesystem::path folder_;
  Policy policy_;
  base::posix::Fd lock_;
  /// Number of the file that is written.
  std::uint64_t number_ = 1;
  /// Closed; to know repeated calls.
  std::optional<ClosedSegment> previous_;
  /// Never null between calls.
  std::unique_ptr<Segment> current_;
};

/// The archive's files in the order they were written.
std::vector<std::filesystem::path> archive_files(const std::filesystem::path& folder);

}  // namespace millrace::services::archiver
