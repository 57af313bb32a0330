// A file of the archive that is only read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "fabric/messages.hpp"

namespace millrace::services::archiver {

/// Functions throw SQLite::Exception when the file cannot be read.
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
