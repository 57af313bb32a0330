#include "services/archiver/row_writer.hpp"

#include <algorithm>
#include <cassert>
#include <ostream>

#include <boost/json/serialize.hpp>
#include <boost/json/string.hpp>

#include "base/text/quoted.hpp"

namespace millrace::services::archiver {

namespace {

std::string as_text(std::string value) {
  std::replace_if(
      value.begin(), value.end(), [](char c) { return c == '\t' || c == '\r' || c == '\n'; }, ' ');
  return base::text::safe(value);
}

std::string as_json_text(const std::string& value) {
  return boost::json::serialize(boost::json::string(value));
}

std::string as_json(const Cell& cell) {
  switch (cell.type) {
    case Cell::Type::null:
      return "null";
    case Cell::Type::text:
      return as_json_text(cell.text);
    default:
      return cell.text;
  }
}

}  // namespace

RowWriter::RowWriter(Format format, std::vector<std::string> columns, std::ostream& out)
    : format_(format), columns_(std::move(columns)), out_(out) {
  if (format_ == Format::jsonl) {
    return;
  }
  std::vector<Cell> header;
  header.reserve(columns_.size());
  for (const std::string& column : columns_) {
    header.push_back({.type = Cell::Type::text, .text = column});
  }
  write_line(header);
}

void RowWriter::write(const std::vector<Cell>& cells) {
  assert(cells.size() == columns_.size());
  if (format_ == Format::jsonl) {
    write_object(cells);
  } else {
    write_line(cells);
  }
}

void RowWriter::write_line(const std::vector<Cell>& cells) {
  const bool csv = format_ == Format::csv;
  const char* separator = "";
  for (const Cell& cell : cells) {
    out_ << separator << (csv ? base::text::csv_cell(cell.text) : as_text(cell.text));
    separator = csv ? "," : "\t";
  }
  out_ << (csv ? "\r\n" : "\n");
}

void RowWriter::write_object(const std::vector<Cell>& cells) {
  const char* separator = "{";
  for (std::size_t i = 0; i < cells.size(); ++i) {
    out_ << separator << as_json_text(columns_[i]) << ':' << as_json(cells[i]);
    separator = ",";
  }
  out_ << "}\n";
}

}  // namespace millrace::services::archiver
