// A file of the archive: an SQLite database; in WAL mode and written a batch at a time while it is
// the newest, closed and only read later.
//
//   Segment segment(folder / "archive-000001.db", {.begun = now, .first_put = 1});
//   const auto ids = segment.append(rows);    // durable when it returns
//
// All functions throw SQLite::Exception when the file cannot be read or written.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "services/archiver/row.hpp"

namespace millrace::services::archiver {

/// What a new file starts with; an existing one has its own.
struct Beginning {
  fabric::Time begun{};
  std::int64_t first_put = 1;
};

class Segment {
 public:
  /// Opens `file` and makes it if it is not there; an older one gets the tables of today. Throws
  /// std::runtime_error for a file of a newer millrace.
  Segment(const std::filesystem::path& file, const Beginning& beginning);
  ~Segment();
  Segment(Segment&&) noexcept;
  Segment& operator=(Segment&&) noexcept;

  /// Adds all rows or none, in one transaction. Returns the id of each put, 0 for the other rows; a
  /// put whose call is here already has the id it had.
  std::vector<std::int64_t> append(const std::vector<Row>& rows);
  /// What the next new put will have.
  [[nodiscard]] std::int64_t next_put() const;

  [[nodiscard]] fabric::Time begun() const;
  /// end() has been called, perhaps by an earlier process; nothing may be added.
  [[nodiscard]] bool ended() const;
  /// In bytes, with what is not yet moved out of its write-ahead log.
  [[nodiscard]] std::uintmax_t size() const;
  /// Leaves a single plain file that can be copied, and read on read-only media.
  void end(fabric::Time now);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A file of the archive that is only read.
class ClosedSegment {
 public:
  explicit ClosedSegment(const std::filesystem::path& file);
  ~ClosedSegment();
  ClosedSegment(ClosedSegment&&) noexcept;
  ClosedSegment& operator=(ClosedSegment&&) noexcept;

  /// The id of the put of this call.
  [[nodiscard]] std::optional<std::int64_t> find(fabric::CallId call);
  /// When it was closed.
  [[nodiscard]] fabric::Time ended() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::services::archiver
