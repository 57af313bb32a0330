#include "tools/print/entry_csv.hpp"

#include <array>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::print {

namespace {

/// Names of the JSON fields, which are the names of the columns.
constexpr std::array<std::string_view, 20> columns{
    "time",     "kind",    "machine",  "channel", "call",          "attempt", "uuid",
    "event",    "reply",   "code",     "text",    "text_size",     "state",   "instance",
    "received", "started", "answered", "detail",  "channel_state", "replayed"};

std::string cell(const boost::json::value& value) {
  return base::text::csv_cell(value.is_string() ? std::string(value.get_string())
                                                : json_text(value));
}

}  // namespace

std::string csv_header() {
  return fmt::format("{}\r\n", fmt::join(columns, ","));
}

std::string csv_row(const recording::Entry& entry) {
  const boost::json::object fields = json_of(entry);
  std::vector<std::string> cells;
  for (const std::string_view column : columns) {
    const boost::json::value* value = fields.if_contains(column);
    cells.push_back(value != nullptr ? cell(*value) : "");
  }
  return fmt::format("{}\r\n", fmt::join(cells, ","));
}

}  // namespace millrace::tools::print
