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

/// Unknown (monostate), text in UTF-8, boolean, number, time, duration, or JSON for CSV and JSON
/// only. The terminal shows a time as its age, and "-" for unknown; JSON has null, CSV nothing.
using Cell = std::variant<std::monostate, std::string, bool, std::int64_t, double, fabric::Time,
                          std::chrono::nanoseconds, boost::json::value>;

/// On a narrow terminal the columns of the highest rank are omitted first; then the texts of those
/// that always stay or have `is_text` are cut, the widest first. A column that is unknown in all
/// rows is omitted, too.
using Rank = std::uint8_t;
inline constexpr Rank always = 0;
/// Shown only with Format::wide or by Format::columns.
inline constexpr Rank only_wide = 255;

struct Heading {
  std::string title{};
  std::string name{};
  Align align = Align::left;
  Rank rank = always;
  bool is_text = false;
};

struct Format {
  enum class Kind : std::uint8_t { terminal, csv, json };
  Kind kind = Kind::terminal;
  /// Of the terminal in characters; 0 = unlimited.
  std::size_t width = 0;
  /// All columns, for any width.
  bool wide = false;
  /// The columns to show, by title or name, without regard to case; empty = all.
  std::vector<std::string> columns{};
};

/// Rows of cells in a format; all of `format.columns` must exist.
std::string listing_text(const std::vector<Heading>& headings,
                         const std::vector<std::vector<Cell>>& rows, const Format& format,
                         fabric::Time now);
/// Index of the column with this title or name that `kind` shows, or headings.size().
std::size_t find_column(const std::vector<Heading>& headings, std::string_view column,
                        Format::Kind kind);
/// "channel, state, since": the values of --columns.
std::string column_names(const std::vector<Heading>& headings, Format::Kind kind);

template <typename Row>
struct ListingColumn {
  std::string title;
  std::string name;
  Cell (*of)(const Row&);
  Align align = Align::left;
  Rank rank = always;
  bool is_text = false;
};

template <typename Row>
class Listing {
 public:
  Listing(std::initializer_list<ListingColumn<Row>> columns) {
    for (const ListingColumn<Row>& column : columns) {
      headings_.push_back({column.title, column.name, column.align, column.rank, column.is_text});
      cells_.push_back(column.of);
    }
  }

  /// Adds each field of `Value` for CSV and JSON; `of` returns nullptr where a row has no value.
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

  /// The columns of with_fields() come first.
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
