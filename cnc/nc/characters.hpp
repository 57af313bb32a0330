// Classes and case of the characters of CP1252, independent of the locale.
#pragma once

#include <string>
#include <string_view>

namespace millrace::cnc::nc {

constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
/// Letters of CP1252, the code page of all strings (IB/tf5200_ads_access_to_cnc/312759947), and _.
constexpr bool is_letter(char c) {
  if ((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_') {
    return true;
  }
  switch (const auto code = static_cast<unsigned char>(c)) {
    case 0x8A:  // S, OE, Z, Y with their marks
    case 0x8C:
    case 0x8E:
    case 0x9A:
    case 0x9C:
    case 0x9E:
    case 0x9F:
      return true;
    default:
      return code >= 0xC0 && code != 0xD7 && code != 0xF7;  // not the signs of x and /
  }
}
constexpr char upper(char c) {
  if (c >= 'a' && c <= 'z') {
    return static_cast<char>(c - 'a' + 'A');
  }
  switch (const auto code = static_cast<unsigned char>(c)) {
    case 0x9A:
    case 0x9C:
    case 0x9E:
      return static_cast<char>(code - 0x10U);
    case 0xFF:
      return static_cast<char>(0x9F);
    default:
      return code >= 0xE0 && code != 0xF7 ? static_cast<char>(code - 0x20U) : c;
  }
}
/// Separators within a block: blank, TAB, NUL (IB/tf5200_programming_manual/205944843).
constexpr bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\0';
}
/// Line ends: LF, CR and ETX (code 3).
constexpr bool is_line_end(char c) {
  return c == '\n' || c == '\r' || static_cast<int>(c) == 3;
}

inline std::string upper(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    c = upper(c);
  }
  return out;
}

/// Compares without regard to case.
constexpr bool same_word(std::string_view left, std::string_view right) {
  if (left.size() != right.size()) {
    return false;
  }
  for (std::size_t i = 0; i < left.size(); ++i) {
    if (upper(left[i]) != upper(right[i])) {
      return false;
    }
  }
  return true;
}

}  // namespace millrace::cnc::nc
