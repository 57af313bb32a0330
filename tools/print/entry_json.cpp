// Entries as JSON and as rows of CSV.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/print/data.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::print {

namespace {

using recording::Entry;
using recording::Sample;

template <std::size_t index>
void add_columns(const std::set<std::string>& kinds, std::vector<std::string>& columns) {
  using Its = std::variant_alternative_t<index, Sample>;
  if (!kinds.empty() &&
      !kinds.contains(std::string(kind_of(Entry{.sample = Sample(std::in_place_index<index>)})))) {
    return;
  }
  std::vector<std::string> names = names_of(fabric::shape_of<Its>());
  // Members that are derived from the fields.
  if constexpr (std::is_same_v<Its, fabric::ProgramEvent>) {
    names.emplace_back("duration_s");
  }
  for (std::string& name : names) {
    if (std::find(columns.begin(), columns.end(), name) == columns.end()) {
      columns.push_back(std::move(name));
    }
  }
}

}  // namespace

boost::json::object json_of(const Entry& entry) {
  boost::json::object out;
  put_time(out, "time", entry.at);
  out["kind"] = kind_of(entry);
  std::visit(
      [&](const auto& sample) {
        using Its = std::decay_t<decltype(sample)>;
        if constexpr (std::is_same_v<Its, fabric::ProgramEvent>) {
          put_program(out, sample);
        } else {
          put_fields(out, sample, entry.withheld);
        }
      },
      entry.sample);
  if (!entry.uuid.empty()) {
    out["uuid"] = utf8(entry.uuid);
  }
  return out;
}

Csv::Csv(const std::set<std::string>& kinds) : columns_{"time", "kind", "uuid"} {
  [&]<std::size_t... index>(std::index_sequence<index...>) {
    (add_columns<index>(kinds, columns_), ...);
  }
  (std::make_index_sequence<std::variant_size_v<Sample>>());
}

std::string Csv::header() const {
  return fmt::format("{}\r\n", fmt::join(columns_, ","));
}

std::string Csv::row(const Entry& entry) const {
  const boost::json::object fields = json_of(entry);
  std::vector<std::string> cells;
  for (const std::string& column : columns_) {
    const boost::json::value* const value = fields.if_contains(column);
    cells.push_back(value == nullptr
                        ? ""
                        : base::text::csv_cell(value->is_string() ? std::string(value->get_string())
                                                                  : json_text(*value)));
  }
  return fmt::format("{}\r\n", fmt::join(cells, ","));
}

}  // namespace millrace::tools::print
