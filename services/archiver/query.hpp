// Reads the archive: rows of one kind that pass a filter, in the order in which they were written.
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

/// Fields that are not set let all rows pass.
struct Filter {
  Kind kind = Kind::put;
  std::optional<fabric::Time> since{};
  /// Exclusive.
  std::optional<fabric::Time> until{};
  std::optional<std::string> machine{};
  std::optional<std::uint16_t> channel{};
  /// For example "5f3a-17".
  std::optional<std::string> call{};
  /// Samples only.
  std::optional<std::string> group{};
  std::optional<std::string> variable{};
  /// Puts only: those that have this field, and with this value if it is set.
  std::optional<std::string> key{};
  std::optional<std::string> value{};
  /// The most rows.
  std::optional<std::uint64_t> limit{};
};

struct Found {
  std::uint64_t rows = 0;
  /// False if there are files and none is readable: then nothing was written, not even a header.
  bool read = true;
  /// A line for each file that cannot be read completely.
  std::vector<std::string> unread{};
};

/// Writes the matching rows; works while an archiver writes. Continues after a file that cannot be
/// read. Throws std::filesystem::filesystem_error for a folder that cannot be read.
Found write_rows(const std::filesystem::path& folder, const Filter& filter, Format format,
                 std::ostream& out);

// millrace-archiver query and millrace-archiver export: the archive as text.

/// `query` shows rows to a person, `export` writes all of them for another program. `argv` is the
/// command line without the command's name. Both work while an archiver writes. Return an exit
/// code.
int query(int argc, char** argv);
int export_rows(int argc, char** argv);

}  // namespace millrace::services::archiver
