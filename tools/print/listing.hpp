// A listing: one table of columns gives the text for a terminal, CSV and JSON.
//
//   const Listing<fabric::ChannelStatus> channels{
//       {"CHANNEL", "", [](const auto& row) -> Cell { return row.key.to_string(); }},
//       {"STATE", "channel_state", [](const auto& row) -> Cell { return word(row.state); }},
//       {"SINCE", "since", [](const auto& row) -> Cell { return row.since; }, Align::right, 2}};
//   std::string text = channels.text(rows, {.width = 80}, now);
//
// A column without a title is for CSV and JSON only, one without a name for the terminal only.
// with_fields() adds all fields of a value of the fabric for CSV and JSON.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "fabric/messages.hpp"
#include "fabric/shape.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"

namespace millrace::tools::print {

/// Unknown; a text in UTF-8; a truth; a number; a time; a duration; any JSON, for CSV and JSON.
/// The terminal shows a time as the time since then, and what is unknown as "-".
using Cell = std::variant<std::monostate, std::string, bool, std::int64_t, double, fabric::Time,
                          std::chrono::nanoseconds, boost::json::value>;

/// Columns with a higher one leave first where the terminal is too narrow. Those that always stay
/// are cut then, the widest first. One that is unknown in each row leaves, too.
using Rank = std::uint8_t;
inline constexpr Rank always = 0;
/// Only with Format::wide or if chosen.
inline constexpr Rank only_wide = 255;

struct Heading {
  std::string title{};
  std::string name{};
  Align align = Align::left;
  Rank rank = always;
};

struct Format {
  enum class Kind : std::uint8_t { terminal, csv, json };
  Kind kind = Kind::terminal;
  /// Columns of the terminal; 0 = as many as the text needs.
  std::size_t width = 0;
  /// All columns, whatever the width.
  bool wide = false;
  /// By title or name, in any case; none = all.
  std::vector<std::string> columns{};
};

/// Rows of cells in a format; `format.columns` are known.
std::string listing_text(const std::vector<Heading>& headings,
                         const std::vector<std::vector<Cell>>& rows, const Format& format,
                         fabric::Time now);
/// Where a column with this title or name stands that `kind` shows, or headings.size().
std::size_t find_column(const std::vector<Heading>& headings, std::string_view column,
                        Format::Kind kind);
/// "channel, state, since": what --columns takes.
std::string column_names(const std::vector<Heading>& headings, Format::Kind kind);

template <typename Row>
struct ListingColumn {
  std::string title;
  std::string name;
  Cell (*of)(const Row&);
  Align align = Align::left;
  Rank rank = always;
};

template <typename Row>
class Listing {
 public:
  Listing(std::initializer_list<ListingColumn<Row>> columns) {
    for (const ListingColumn<Row>& column : columns) {
      headings_.push_back({column.title, column.name, column.align, column.rank});
      cells_.push_back(column.of);
    }
  }

  /// For CSV and JSON also each field of `Value`; `of` is nullptr where a row has none.
  template <fabric::HasFields Value>
  Listing with_fields(const Value* (*of)(const Row&)) && {
    for (const std::string& name : names_of(fabric::shape_of<Value>())) {
      if (find_column(headings_, name, Format::Kind::json) == headings_.size()) {
        headings_.insert(headings_.begin() + static_cast<std::ptrdiff_t>(fields_++), {"", name});
      }
    }
    puts_.push_back([of](boost::json::object& out, const Row& row) {
      if (const Value* value = of(row)) {
        put_fields(out, *value);
      }
    });
    return std::move(*this);
  }

  /// Those of with_fields() first.
  [[nodiscard]] const std::vector<Heading>& headings() const { return headings_; }

  [[nodiscard]] std::string text(const std::vector<Row>& rows, const Format& format,
                                 fabric::Time now) const {
    std::vector<std::vector<Cell>> cells;
    for (const Row& row : rows) {
      boost::json::object fields;
      for (const auto& put : puts_) {
        put(fields, row);
      }
      std::vector<Cell>& line = cells.emplace_back();
      for (std::size_t i = 0; i < fields_; ++i) {
        const boost::json::value* const found = fields.if_contains(headings_[i].name);
        line.push_back(found == nullptr ? Cell() : Cell(*found));
      }
      for (const auto of : cells_) {
        line.push_back(of(row));
      }
    }
    return listing_text(headings_, cells, format, now);
  }

 private:
  std::vector<Heading> headings_;
  std::size_t fields_ = 0;
  std::vector<Cell (*)(const Row&)> cells_;
  std::vector<std::function<void(boost::json::object&, const Row&)>> puts_;
};

}  // namespace millrace::tools::print
