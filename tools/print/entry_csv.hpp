// Entries as comma-separated values: one row each, the same columns for every kind, UTF-8, quoted
// as RFC 4180 has it. Times are ISO 8601 in UTC.
#pragma once

#include <string>

#include "tools/recording/entry.hpp"

namespace millrace::tools::print {

/// The names of the columns, with line end.
std::string csv_header();
std::string csv_row(const recording::Entry& entry);

}  // namespace millrace::tools::print
