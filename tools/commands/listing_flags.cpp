#include "tools/commands/listing_flags.hpp"

#include <cstdlib>

#include "base/program/command_line.hpp"
#include "base/text/ascii.hpp"
#include "tools/commands/screen.hpp"

namespace millrace::tools::commands {

std::size_t width_of_output() {
  const char* const columns = std::getenv("COLUMNS");
  if (const auto width = base::text::parse_number<std::size_t>(columns == nullptr ? "" : columns)) {
    return *width;
  }
  return output_is_terminal() ? Screen::size().columns : 0;
}

ListingFlags::ListingFlags(CLI::App& command) {
  CLI::Option* const as_json = command.add_flag("--json", json, "Print JSON");
  CLI::Option* const as_csv =
      command.add_flag("--csv", csv, "Print comma-separated values")->excludes(as_json);
  CLI::Option* const form = command.add_option_function<std::string>(
      "-o,--output", [this](const std::string& name) { (name == "json" ? json : csv) = true; });
  // The same in the words of other tools; not in the help.
  form->check(CLI::IsMember({"json", "csv"}))->group("")->excludes(as_json)->excludes(as_csv);
  of_table_ = {
      as_csv, command.add_flag("--wide", wide, "All columns, also where the terminal is narrower"),
      command.add_option("--columns", columns, "These columns in this order, as in name,busy")
          ->delimiter(',')
          ->allow_extra_args(false)};
}

void ListingFlags::exclude(CLI::Option* option) const {
  for (CLI::Option* const flag : of_table_) {
    option->excludes(flag);
  }
}

print::Format ListingFlags::format(const std::vector<print::Heading>& headings) const {
  using Kind = print::Format::Kind;
  const Kind kind = json ? Kind::json : csv ? Kind::csv : Kind::terminal;
  for (const std::string& column : columns) {
    if (print::find_column(headings, column, kind) == headings.size()) {
      throw base::program::UsageError(fmt::format("--columns: unknown column '{}'; expected {}",
                                                  column, print::column_names(headings, kind)));
    }
  }
  return {.kind = kind,
          .width = kind == Kind::terminal ? width_of_output() : 0,
          .wide = wide,
          .columns = columns};
}

}  // namespace millrace::tools::commands
