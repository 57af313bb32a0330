// Reading the archive: rows of one kind that pass a filter, in the order they were written.
//
//   write_rows(folder, {.key = "part", .value = "WELLE7"}, Format::csv, std::cout);
#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "fabric/messages.hpp"
#include "services/archiver/row_writer.hpp"

namespace millrace::services::archiver {

enum class Kind : std::uint8_t { put, event, channel, sample, program };

/// What is not set lets everything pass.
struct Filter {
  Kind kind = Kind::put;
  std::optional<fabric::Time> since{};
  /// Not included.
  std::optional<fabric::Time> until{};
  std::optional<std::string> machine{};
  std::optional<std::uint16_t> channel{};
  /// "5f3a-17".
  std::optional<std::string> call{};
  /// Of samples only.
  std::optional<std::string> group{};
  std::optional<std::string> variable{};
  /// Of puts only: those that have this field, and with this value if there is one.
  std::optional<std::string> key{};
  std::optional<std::string> value{};
  /// At most so many rows.
  std::optional<std::uint64_t> limit{};
};

struct Found {
  std::uint64_t rows = 0;
  /// False if there are files and none of them can be read: nothing was written then, no header
  /// either.
  bool read = true;
  /// A line for each file that cannot be read, or not to its end.
  std::vector<std::string> unread{};
};

/// Writes what is found; works while an archiver writes. Goes on after a file that cannot be read.
/// Throws std::filesystem::filesystem_error for a folder that cannot be.
Found write_rows(const std::filesystem::path& folder, const Filter& filter, Format format,
                 std::ostream& out);

}  // namespace millrace::services::archiver
