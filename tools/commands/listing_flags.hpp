// The output that a listing command takes: --json, --csv, --wide, --columns; on a terminal as wide
// as that is.
#pragma once

#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <fmt/format.h>

#include "tools/print/listing.hpp"

namespace millrace::tools::commands {

/// Of the terminal, or of COLUMNS in the environment, which wins as with other commands; 0 where
/// the output is no terminal.
std::size_t width_of_output();

struct ListingFlags {
  /// Adds the flags to `command`.
  explicit ListingFlags(CLI::App& command);

  /// Throws UsageError if --columns names one that the listing does not have.
  [[nodiscard]] print::Format format(const std::vector<print::Heading>& headings) const;
  /// Whether people read it.
  [[nodiscard]] bool is_text() const { return !json && !csv; }

  bool json = false;
  bool csv = false;
  bool wide = false;
  std::vector<std::string> columns{};
};

template <typename Row>
void print_listing(const print::Listing<Row>& listing, const std::vector<Row>& rows,
                   const ListingFlags& flags) {
  fmt::print(
      "{}", listing.text(rows, flags.format(listing.headings()), std::chrono::system_clock::now()));
}

}  // namespace millrace::tools::commands
