#include "base/text/quoted.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>

#include <fmt/format.h>

#include "base/text/ascii.hpp"
#include "base/text/controls.hpp"
#include "base/text/cp1252.hpp"

namespace millrace::base::text {

namespace {

bool is_undefined(char c) {
  const auto byte = static_cast<std::uint8_t>(c);
  return byte == 0x81 || byte == 0x8d || byte == 0x8f || byte == 0x90 || byte == 0x9d;
}

bool is_number(std::string_view text) {
  double number = 0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  return error == std::errc{} && end == last;
}

/// True if a spreadsheet would take the text for a formula. Some ignore spaces before it; Excel
/// also knows the full-width forms of the marks.
bool is_formula(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  constexpr std::array<std::string_view, 8> marks{
      "=", "+", "-", "@", "\xef\xbc\x9d", "\xef\xbc\x8b", "\xef\xbc\x8d", "\xef\xbc\xa0"};
  return std::ranges::any_of(marks,
                             [&](std::string_view mark) { return text.starts_with(mark); }) &&
         !is_number(text);
}

std::string escaped(char c) {
  return fmt::format("\\x{:02x}", static_cast<std::uint8_t>(c));
}

}  // namespace

std::string quoted(std::string_view cp1252) {
  std::string out = "\"";
  for (const char c : cp1252) {
    if (is_control(c) || is_undefined(c)) {
      out += escaped(c);
    } else if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else {
      out += to_utf8({&c, 1});
    }
  }
  return out + '"';
}

std::string safe(std::string_view utf8, std::string_view kept) {
  // Text that is not UTF-8 does not come from us.
  const bool is_text = is_utf8(utf8);
  std::string out;
  for (std::size_t i = 0; i < utf8.size(); ++i) {
    const char c = utf8[i];
    const auto control = is_text ? control_at(utf8.substr(i)) : std::nullopt;
    if (control && control->size > 1) {
      out += control->code < 0x100 ? fmt::format("\\x{:02x}", control->code)
                                   : fmt::format("\\u{:04x}", control->code);
      i += control->size - 1;
    } else if ((is_control(c) && kept.find(c) == std::string_view::npos) ||
               (!is_text && static_cast<std::uint8_t>(c) >= 0x80)) {
      out += escaped(c);
    } else {
      out += c;
    }
  }
  return out;
}

std::string csv_cell(std::string_view utf8) {
  // A spreadsheet in German or French splits lines at semicolons, and ignores quotes inside of what
  // it takes for a cell.
  std::string text;
  for (std::size_t begin = 0; begin <= utf8.size();) {
    const std::size_t end = std::min(utf8.find(';', begin), utf8.size());
    const std::string_view part = utf8.substr(begin, end - begin);
    text += (begin > 0 ? ";" : "") + std::string(is_formula(part) ? "'" : "") + safe(part);
    begin = end + 1;
  }
  if (text.find_first_of(",;\"") == std::string::npos) {
    return text;
  }
  std::string cell = "\"";
  for (const char c : text) {
    cell += c == '"' ? "\"\"" : std::string(1, c);
  }
  return cell + '"';
}

std::string xml_text(std::string_view utf8) {
  std::string out;
  for (const char c : utf8) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&apos;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string shell_word(std::string_view word) {
  const auto is_plain = [](char c) {
    return is_alphanumeric(c) || std::string_view("_-./:@%+").find(c) != std::string_view::npos;
  };
  if (!word.empty() && std::ranges::all_of(word, is_plain)) {
    return std::string(word);
  }
  std::string quoted = "'";
  for (const char c : word) {
    quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return quoted + '\'';
}

}  // namespace millrace::base::text
