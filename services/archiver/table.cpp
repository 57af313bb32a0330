#include "services/archiver/table.hpp"

#include <algorithm>
#include <cassert>
#include <ostream>

#include <fmt/format.h>

#include "base/text/characters.hpp"

namespace millrace::services::archiver {

namespace {

std::string as_text(std::string value) {
  std::replace_if(value.begin(), value.end(), base::text::is_control, ' ');
  return value;
}

std::string as_csv(const std::string& value) {
  if (value.find_first_of(",\"\r\n") == std::string::npos) {
    return value;
  }
  std::string quoted = "\"";
  for (const char c : value) {
    quoted += c;
    if (c == '"') {
      quoted += c;
    }
  }
  return quoted + '"';
}

std::string as_json_text(const std::string& value) {
  std::string quoted = "\"";
  for (const char c : value) {
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (base::text::is_control(c)) {
      quoted += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
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

Table::Table(Format format, std::vector<std::string> columns, std::ostream& out)
    : format_(format), columns_(std::move(columns)), out_(out) {
  if (format_ == Format::jsonl) {
    return;
  }
  std::vector<Cell> header;
  for (const std::string& column : columns_) {
    header.push_back({.type = Cell::Type::text, .text = column});
  }
  write_line(header);
}

void Table::write(const std::vector<Cell>& cells) {
  assert(cells.size() == columns_.size());
  if (format_ == Format::jsonl) {
    write_object(cells);
  } else {
    write_line(cells);
  }
}

void Table::write_line(const std::vector<Cell>& cells) {
  const bool csv = format_ == Format::csv;
  const char* separator = "";
  for (const Cell& cell : cells) {
    out_ << separator << (csv ? as_csv(cell.text) : as_text(cell.text));
    separator = csv ? "," : "\t";
  }
  out_ << (csv ? "\r\n" : "\n");
}

void Table::write_object(const std::vector<Cell>& cells) {
  const char* separator = "{";
  for (std::size_t i = 0; i < cells.size(); ++i) {
    out_ << separator << as_json_text(columns_[i]) << ':' << as_json(cells[i]);
    separator = ",";
  }
  out_ << "}\n";
}

}  // namespace millrace::services::archiver
