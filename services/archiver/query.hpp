// Reading the archive: rows of one kind that pass a filter, in the order they were written.
//
//   write_rows(folder, {.key = "part", .value = "WELLE7"}, Format::csv, std::cout);
#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>

#include "services/archiver/filter.hpp"
#include "services/archiver/table.hpp"

namespace millrace::services::archiver {

/// Writes what is found and returns the number of rows; works while an archiver writes. Throws
/// std::runtime_error or SQLite::Exception for a folder or file that cannot be read.
std::uint64_t write_rows(const std::filesystem::path& folder, const Filter& filter, Format format,
                         std::ostream& out);

}  // namespace millrace::services::archiver
