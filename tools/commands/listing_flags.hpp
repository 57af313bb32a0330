// The output options of a listing command: --json, --csv, --wide, --columns; and the terminal
// width.
#pragma once

#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <fmt/format.h>

#include "tools/print/listing.hpp"

namespace millrace::tools::commands {

/// In characters: COLUMNS in the environment, otherwise the width of the terminal; 0 if the output
/// is not a terminal.
std::size_t width_of_output();

struct ListingFlags {
  /// Adds the flags to `command`.
  explicit ListingFlags(CLI::App& command);

  /// Throws UsageError if --columns names a column that the listing does not have.
  [[nodiscard]] print::Format format(const std::vector<print::Heading>& headings) const;
  /// With `option` there is no table, so --csv, --wide and --columns are refused.
  void exclude(CLI::Option* option) const;
  /// Output for people.
  [[nodiscard]] bool is_text() const { return !json && !csv; }

  bool json = false;
  bool csv = false;
  bool wide = false;
  std::vector<std::string> columns{};

 private:
  std::vector<CLI::Option*> of_table_;
};

template <typename Row>
void print_listing(const print::Listing<Row>& listing, const std::vector<Row>& rows,
                   const ListingFlags& flags) {
  fmt::print(
      "{}", listing.text(rows, flags.format(listing.headings()), std::chrono::system_clock::now()));
}

}  // namespace millrace::tools::commands
