// Classes of characters and ASCII case, independent of the locale.
#pragma once

#include <string>
#include <string_view>

namespace millrace::cnc::nc {

constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
constexpr bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
constexpr char upper(char c) {
  return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
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

/// Compares without regard to the case of ASCII letters.
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
