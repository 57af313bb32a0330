// Columns for a terminal.
//
//   Table table({"SERVICE", {"CALLS", Align::right}});
//   table.add({"square_root", "17"});
//   std::string text = table.text();
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace millrace::tools::print {

enum class Align : std::uint8_t { left, right };

struct Column {
  std::string title{};
  Align align = Align::left;
};

class Table {
 public:
  explicit Table(std::vector<Column> columns);

  /// One cell per column, whose controls show as \xNN: most of them are foreign texts.
  void add(std::vector<std::string> row);
  [[nodiscard]] bool empty() const { return rows_.empty(); }
  /// Title line and rows, each ended by a newline; no blanks at the end of a line.
  [[nodiscard]] std::string text() const;

 private:
  std::vector<Column> columns_;
  std::vector<std::vector<std::string>> rows_;
};

/// How many columns of a terminal UTF-8 text takes, if each character takes one.
std::size_t width(std::string_view utf8);
/// The first `characters` of UTF-8.
std::string first_of(std::string_view utf8, std::size_t characters);
/// Lines of at most `most` characters, broken at blanks; 0 = one line. The second and further ones
/// begin with `indent` blanks. A longer word keeps its line.
std::string wrapped(std::string_view utf8, std::size_t most, std::size_t indent);

}  // namespace millrace::tools::print
