// Writes rows as text, for people and programs.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace millrace::services::archiver {

enum class Format : std::uint8_t {
  /// A header and one row per line, separated by tabs. Tabs and line ends in values become blanks,
  /// other controls \xNN.
  text,
  /// RFC 4180 with a header: comma, double quotes where needed, CR LF.
  csv,
  /// One JSON object per line.
  jsonl
};

struct Cell {
  enum class Type : std::uint8_t { null, number, text, json };
  Type type = Type::null;
  /// UTF-8; the digits of a number, the JSON of a json cell.
  std::string text{};
};

/// Writes rows one by one.
class RowWriter {
 public:
  RowWriter(Format format, std::vector<std::string> columns, std::ostream& out);
  /// One cell for each column.
  void write(const std::vector<Cell>& cells);

 private:
  void write_line(const std::vector<Cell>& cells);
  void write_object(const std::vector<Cell>& cells);

  Format format_;
  std::vector<std::string> columns_;
  std::ostream& out_;
};

}  // namespace millrace::services::archiver
