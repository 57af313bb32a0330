// A file of the archive: an SQLite database. The newest is in WAL mode and written batch by batch;
// a closed one is only read.
//
//   Segment segment(folder / "archive-000001.db", {.begun = now, .first_put = 1});
//   const auto ids = segment.append(rows);    // durable when it returns
//
// All functions throw SQLite::Exception if the file cannot be read or written, Damaged if it is
// damaged, and Foreign if it is not ours.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include "services/archiver/row.hpp"

namespace SQLite {
class Database;
}

namespace millrace::services::archiver {

/// Initial values of a file without a put; a file with puts has its own.
struct Beginning {
  fabric::Time begun{};
  std::int64_t first_put = 1;
};

/// How long an open waits while the file is being closed.
inline constexpr int busy_timeout_ms = 5000;

/// A file with a name of ours that another program made, or that is damaged.
class Foreign : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A damaged file that may be ours.
class Damaged : public Foreign {
 public:
  using Foreign::Foreign;
};

class Segment {
 public:
  /// Opens `file`; creates it if it is missing or empty; migrates an older one. Checks its contents
  /// before any write. Throws std::runtime_error for a file of a newer millrace.
  Segment(const std::filesystem::path& file, const Beginning& beginning);
  /// Leaves a single regular file unless another process reads it; see close().
  ~Segment();
  Segment(Segment&&) noexcept;
  Segment& operator=(Segment&&) noexcept;

  /// Adds all rows or none, in one transaction. Returns the id of each put, 0 for the other rows; a
  /// put whose call is already in the file keeps its id. Throws std::runtime_error if the file was
  /// moved or removed since it was opened.
  std::vector<std::int64_t> append(const std::vector<Row>& rows);
  /// The id of the next new put.
  [[nodiscard]] std::int64_t next_put() const;

  [[nodiscard]] fabric::Time begun() const;
  /// close() was called, possibly by an earlier process; no row may be added.
  [[nodiscard]] bool ended() const;
  /// In bytes, once its write-ahead log is merged into it.
  [[nodiscard]] std::uintmax_t size() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Ends a finished file, at `now` if it was not ended before, and leaves a single regular file that
/// can be copied, and read on read-only media. False if another process has it open: try again
/// later. Does not wait.
bool close(const std::filesystem::path& file, fabric::Time now);

/// Opens a file of the archive only to read it, also while an archiver writes. One whose archiver
/// did not end orderly is in WAL mode, which needs write access to its folder: without that it is
/// read as it is on the disk, if it has no write-ahead log with further rows.
SQLite::Database open_to_read(const std::filesystem::path& file);

/// A file of the archive that is only read.
class ClosedSegment {
 public:
  explicit ClosedSegment(const std::filesystem::path& file);
  ~ClosedSegment();
  ClosedSegment(ClosedSegment&&) noexcept;
  ClosedSegment& operator=(ClosedSegment&&) noexcept;

  /// The id of the put of this call.
  [[nodiscard]] std::optional<std::int64_t> find(fabric::CallId call);
  /// The id of the next put after those of this file.
  [[nodiscard]] std::int64_t next_put() const;
  /// When the file was ended; nullopt if it was not.
  [[nodiscard]] std::optional<fabric::Time> ended() const;
  /// True if it is ended and a single regular file.
  [[nodiscard]] bool closed() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The tables of an archive file, and the migration of older files.
//
//   archive  one row: begin and end of the file, and the id of its first put
//   put      data from NC programs: one row per call id
//   field    the key=value pairs of a put
//   event    events of calls, hop by hop
//   channel  states of channels; a repeated state is one row
//   variable sampled variables of machines: each variable of a group once
//   sample   values of variables: one row when the value or its quality changes; an array as JSON
//   program  events of NC programs
//
// Times are nanoseconds since 1970-01-01T00:00:00Z, texts UTF-8. call is "EPOCH-NUMBER" as in logs.

/// The version that this process writes (PRAGMA user_version).
inline constexpr int schema_version = 3;

/// Throws std::runtime_error for a file of a newer version, and changes nothing.
void refuse_newer(SQLite::Database& database);

/// Migrates a new or older file to schema_version, in one transaction. Throws std::runtime_error
/// for a file of a newer version, SQLite::Exception for one that is not a database.
void migrate(SQLite::Database& database);

}  // namespace millrace::services::archiver
