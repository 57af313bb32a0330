// A folder of archive files: the newest is written, the others are closed and kept for a configured
// time.
//
//   Archive archive("/var/lib/millrace/archive", policy, now, report);
//   const auto ids = archive.append(rows, now);
//   archive.tidy_up(now, Ages::believed);         // periodically, between batches
//
// Functions throw SQLite::Exception or std::runtime_error if the folder or its files cannot be read
// or written.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/posix/system.hpp"
#include "fabric/messages.hpp"
#include "services/archiver/segment.hpp"

namespace millrace::services::archiver {

// Decides when a file of the archive is closed, and which closed files are removed. Pure.

/// Zero = no limit, for each of the four.
struct Policy {
  std::uintmax_t rotate_bytes = 256ULL << 20U;
  std::chrono::hours rotate_age{24};
  std::chrono::hours keep_age{365 * 24};
  std::uintmax_t keep_bytes = 10240ULL << 20U;
};

/// True if a file with this begin and size must be closed; also if it was begun by a clock that was
/// ahead by more than the maximum age of a file.
bool must_rotate(const Policy& policy, fabric::Time begun, std::uintmax_t bytes, fabric::Time now);

/// A closed file.
struct Closed {
  std::uintmax_t bytes = 0;
  /// Nullopt if unknown: then the file does not expire by age.
  std::optional<fabric::Time> ended{};
};

/// How many of `closed`, oldest first, must be removed beside an open file of `open_bytes`. The
/// newest always stays: it identifies repeated calls.
std::size_t expired(const Policy& policy, const std::vector<Closed>& closed,
                    std::uintmax_t open_bytes, fabric::Time now);

/// Whether files may be removed for their age.
enum class Ages : std::uint8_t { believed, doubted };

class Archive {
 public:
  /// Receives the faults that an operator should know and that do not stop the archive.
  using Report = std::function<void(const std::string&)>;

  /// Creates a missing folder. A file in it that is damaged or not ours is reported and left
  /// unchanged. Throws also if another process writes to the folder.
  Archive(
      std::filesystem::path folder, const Policy& policy, fabric::Time now,
      Report report = [](const std::string&) {});

  /// Adds all rows or none, durably. Begins a new file first if one is due and possible, or if the
  /// current one is damaged. Returns the id of each put, 0 for other rows. A put whose call is in
  /// this file or the one before keeps its id.
  std::vector<std::int64_t> append(const std::vector<Row>& rows, fabric::Time now);

  /// Closes finished files unless another process reads them. Removes expired files if a new file
  /// was begun since the last call.
  void tidy_up(fabric::Time now, Ages ages);
  /// True if a file could not be closed yet.
  [[nodiscard]] bool untidy() const { return !unclosed_.empty(); }

  /// Files of the folder that are damaged or not an archive; left unchanged.
  [[nodiscard]] const std::set<std::filesystem::path>& foreign() const { return foreign_; }

  /// The file that is written.
  [[nodiscard]] std::filesystem::path file() const;
  /// When the newest file was last written before this archive was opened; nullopt for a new one.
  [[nodiscard]] std::optional<fabric::Time> last_written() const { return last_written_; }

 private:
  /// Reads the state of the older files. Returns the id of the next put.
  std::int64_t look_at(const std::vector<std::filesystem::path>& older, fabric::Time now);
  void open_current(fabric::Time now);
  std::vector<std::int64_t> append_to_current(const std::vector<Row>& rows, fabric::Time now);
  /// The id of a call in the file before.
  std::optional<std::int64_t> earlier_id(fabric::CallId call);
  /// Begins the next file; on failure, continues with the current one.
  void rotate(fabric::Time now);
  [[nodiscard]] std::unique_ptr<Segment> begin_next(fabric::Time now) const;
  /// Cannot fail halfway.
  void go_on_in(std::unique_ptr<Segment> next);
  void close_files(fabric::Time now);
  void remove_expired(fabric::Time now, Ages ages);
  /// Reports `file` as damaged or not ours, once.
  void leave(const std::filesystem::path& file, const std::string& why);

  std::filesystem::path folder_;
  Policy policy_;
  Report report_;
  base::posix::Fd lock_;
  std::optional<fabric::Time> last_written_;
  /// Number of the file that is written.
  std::uint64_t number_ = 1;
  /// The file before, to recognise repeated calls; opened on the first query.
  std::filesystem::path previous_file_;
  std::optional<ClosedSegment> previous_;
  /// Never null.
  std::unique_ptr<Segment> current_;
  std::vector<std::filesystem::path> unclosed_;
  std::set<std::filesystem::path> foreign_;
  /// The unclosed files that were reported.
  std::set<std::filesystem::path> reported_unclosed_;
  bool begun_a_file_ = true;
  bool rotation_failed_ = false;
  /// Rows were written to the current file, or it was checked when it was opened.
  bool sound_ = true;
};

/// The files of an archive, in the order of their numbers, which have up to twelve digits.
std::vector<std::filesystem::path> archive_files(const std::filesystem::path& folder);

}  // namespace millrace::services::archiver
