// A file of the archive: an SQLite database; in WAL mode and written a batch at a time while it is
// the newest, closed and only read later.
//
//   Segment segment(folder / "archive-000001.db", {.begun = now, .first_put = 1});
//   const auto ids = segment.append(rows);    // durable when it returns
//
// All functions throw SQLite::Exception when the file cannot be read or written, Damaged when it is
// damaged, and Foreign when it is none of ours.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include "services/archiver/row.hpp"

namespace millrace::services::archiver {

/// What a file without a put starts with; one that has puts has its own.
struct Beginning {
  fabric::Time begun{};
  std::int64_t first_put = 1;
};

/// Who opens a file waits so long while it is being closed.
inline constexpr int busy_timeout_ms = 5000;

/// A file with a name of ours that somebody else made, or that is damaged.
class Foreign : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// It may have been ours.
class Damaged : public Foreign {
 public:
  using Foreign::Foreign;
};

class Segment {
 public:
  /// Opens `file` and makes it if it is not there, or empty; an older one gets the tables of today.
  /// What it has is looked through before anything is written. Throws std::runtime_error for a file
  /// of a newer millrace.
  Segment(const std::filesystem::path& file, const Beginning& beginning);
  ~Segment();
  Segment(Segment&&) noexcept;
  Segment& operator=(Segment&&) noexcept;

  /// Adds all rows or none, in one transaction. Returns the id of each put, 0 for the other rows; a
  /// put whose call is here already has the id it had. Throws std::runtime_error while the file is
  /// not where it was opened.
  std::vector<std::int64_t> append(const std::vector<Row>& rows);
  /// What the next new put will have.
  [[nodiscard]] std::int64_t next_put() const;

  [[nodiscard]] fabric::Time begun() const;
  /// close() has been called, perhaps by an earlier process; nothing may be added.
  [[nodiscard]] bool ended() const;
  /// In bytes, once all of it is moved out of its write-ahead log.
  [[nodiscard]] std::uintmax_t size() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Ends a file that is written no more, at `now` if it was not ended before, and leaves a single
/// plain file that can be copied, and read on read-only media. False if somebody has it open: then
/// that is for later. Does not wait.
bool close(const std::filesystem::path& file, fabric::Time now);

/// A file of the archive that is only read.
class ClosedSegment {
 public:
  explicit ClosedSegment(const std::filesystem::path& file);
  ~ClosedSegment();
  ClosedSegment(ClosedSegment&&) noexcept;
  ClosedSegment& operator=(ClosedSegment&&) noexcept;

  /// The id of the put of this call.
  [[nodiscard]] std::optional<std::int64_t> find(fabric::CallId call);
  /// What the next put after those of this file has.
  [[nodiscard]] std::int64_t next_put() const;
  /// When it was ended; nothing if it was not.
  [[nodiscard]] std::optional<fabric::Time> ended() const;
  /// Ended, and a single plain file.
  [[nodiscard]] bool closed() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::services::archiver
