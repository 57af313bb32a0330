#include "tools/print/table.hpp"

#include <algorithm>
#include <cassert>

#include "base/text/quoted.hpp"

namespace millrace::tools::print {

Table::Table(std::vector<Column> columns) : columns_(std::move(columns)) {}

void Table::add(std::vector<std::string> row) {
  assert(row.size() == columns_.size());
  for (std::string& cell : row) {
    cell = base::text::safe(cell);
  }
  rows_.push_back(std::move(row));
}

std::string Table::text() const {
  std::vector<std::string> titles;
  titles.reserve(columns_.size());
  for (const Column& column : columns_) {
    titles.push_back(column.title);
  }
  std::vector<std::size_t> widths(columns_.size());
  const auto measure = [&](const std::vector<std::string>& row) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      widths[i] = std::max(widths[i], width(row[i]));
    }
  };
  measure(titles);
  std::for_each(rows_.begin(), rows_.end(), measure);

  std::string out;
  const auto append = [&](const std::vector<std::string>& row) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string padding(widths[i] - width(row[i]), ' ');
      line += columns_[i].align == Align::right ? padding + row[i] : row[i] + padding;
      line += "  ";
    }
    out += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
  };
  append(titles);
  std::for_each(rows_.begin(), rows_.end(), append);
  return out;
}

std::size_t width(std::string_view utf8) {
  return static_cast<std::size_t>(std::count_if(utf8.begin(), utf8.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
}

std::string first_of(std::string_view utf8, std::size_t characters) {
  std::size_t seen = 0;
  for (std::size_t i = 0; i < utf8.size(); ++i) {
    const bool begins = (static_cast<unsigned char>(utf8[i]) & 0xC0U) != 0x80U;
    if (begins && ++seen > characters) {
      return std::string(utf8.substr(0, i));
    }
  }
  return std::string(utf8);
}

std::string wrapped(std::string_view utf8, std::size_t most, std::size_t indent) {
  std::string text(utf8);
  std::string out;
  while (most > 0 && width(text) > most) {
    const std::size_t word = text.find_first_not_of(' ');
    std::size_t end = first_of(text, most + 1).rfind(' ');
    if (end == std::string::npos || end < word) {
      end = text.find(' ', word);
    }
    const std::size_t next = text.find_first_not_of(' ', end);
    if (next == std::string::npos) {
      break;
    }
    out += text.substr(0, text.find_last_not_of(' ', end) + 1) + '\n';
    text = std::string(indent, ' ') + text.substr(next);
  }
  return out + text + '\n';
}

}  // namespace millrace::tools::print
