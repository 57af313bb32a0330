#include "cnc/nc/values/format.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "cnc/nc/characters.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::values {
namespace {

constexpr int widest = 200;
constexpr int default_precision = 6;

// Reads a number, limited to `widest`, so that a format cannot request gigabytes.
int read_number(std::string_view format, std::size_t& position) {
  int number = 0;
  while (position < format.size() && is_digit(format[position])) {
    number = std::min(widest, number * 10 + (format[position] - '0'));
    ++position;
  }
  return number;
}

void read_flags(std::string_view format, std::size_t& position, FormatPiece& piece) {
  for (; position < format.size(); ++position) {
    switch (format[position]) {
      case '-':
        piece.left = true;
        break;
      case '0':
        piece.zeros = true;
        break;
      case '+':
        piece.plus = true;
        break;
      default:
        return;
    }
  }
}

// Reads a conversion after its percent sign.
Result<FormatPiece> read_conversion(std::string_view format, std::size_t& position) {
  FormatPiece piece;
  read_flags(format, position, piece);
  piece.width = read_number(format, position);
  if (position < format.size() && format[position] == '.') {
    ++position;
    piece.precision = read_number(format, position);
  }
  const char letter = position < format.size() ? format[position++] : '\0';
  switch (upper(letter)) {
    case 'D':
    case 'I':
      piece.conversion = 'd';
      return piece;
    case 'U':
      piece.conversion = 'u';
      return piece;
    case 'F':
      piece.conversion = 'f';
      return piece;
    case 'S':
      piece.conversion = 's';
      return piece;
    default:
      return fault(20721, "the format \"" + std::string(format) +
                              "\" has an unknown conversion; known are %d %u %f %s %%");
  }
}

std::string digits_of(const FormatPiece& piece, double value) {
  std::array<char, 512> buffer{};
  const int precision = piece.precision < 0 ? default_precision : piece.precision;
  const int length =
      piece.conversion == 'f'
          ? std::snprintf(buffer.data(), buffer.size(), "%.*f", precision, std::abs(value))
          : std::snprintf(buffer.data(), buffer.size(), "%.0f", std::abs(value));
  return {buffer.data(), std::min(static_cast<std::size_t>(length), buffer.size() - 1)};
}

std::string show_number(const FormatPiece& piece, double value) {
  std::string digits = digits_of(piece, value);
  const bool nothing = digits.find_first_not_of("0.") == std::string::npos;
  const std::string sign = value < 0 && !nothing ? "-" : (piece.plus ? "+" : "");
  const auto width = static_cast<std::size_t>(piece.width);
  if (piece.zeros && !piece.left && sign.size() + digits.size() < width) {
    digits.insert(0, width - sign.size() - digits.size(), '0');
  }
  return sign + digits;
}

Result<std::string> show(const FormatPiece& piece, const Value& value) {
  if (piece.conversion == 's') {
    const std::string shown = display(value);
    return piece.precision < 0 ? shown : shown.substr(0, static_cast<std::size_t>(piece.precision));
  }
  if (piece.conversion == 'f') {
    return number(value).map([&](double real) { return show_number(piece, real); });
  }
  const auto whole = integer(value);
  if (!whole) {
    return tl::make_unexpected(whole.error());
  }
  if (piece.conversion == 'u' && *whole < 0) {
    return fault(0, "%u takes no negative number such as " + std::to_string(*whole));
  }
  return show_number(piece, static_cast<double>(*whole));
}

}  // namespace

Result<std::vector<FormatPiece>> parse_format(std::string_view format) {
  std::vector<FormatPiece> pieces(1);
  for (std::size_t position = 0; position < format.size();) {
    const char c = format[position++];
    if (c != '%') {
      pieces.back().literal += c;
    } else if (position < format.size() && format[position] == '%') {
      pieces.back().literal += '%';
      ++position;
    } else {
      auto piece = read_conversion(format, position);
      if (!piece) {
        return tl::make_unexpected(piece.error());
      }
      pieces.push_back(std::move(*piece));
      pieces.emplace_back();
    }
  }
  return pieces;
}

std::size_t conversions(const std::vector<FormatPiece>& pieces) {
  return pieces.size() / 2;
}

Result<std::string> format(std::string_view format, std::span<const Value> values) {
  const auto pieces = parse_format(format);
  if (!pieces) {
    return tl::make_unexpected(pieces.error());
  }
  if (conversions(*pieces) != values.size()) {
    return fault(20721, "the format \"" + std::string(format) + "\" takes " +
                            std::to_string(conversions(*pieces)) + " values, not " +
                            std::to_string(values.size()));
  }
  std::string out;
  std::size_t next = 0;
  for (const FormatPiece& piece : *pieces) {
    if (piece.conversion == 0) {
      out += piece.literal;
      continue;
    }
    auto shown = show(piece, values[next++]);
    if (!shown) {
      return shown;
    }
    const auto width = static_cast<std::size_t>(piece.width);
    const std::string blanks(width > shown->size() ? width - shown->size() : 0, ' ');
    out += piece.left ? *shown + blanks : blanks + *shown;
  }
  return out;
}

}  // namespace millrace::cnc::nc::values
