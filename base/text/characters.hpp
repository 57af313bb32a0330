// Classes of characters, independent of the locale.
#pragma once

namespace millrace::base::text {

/// A control character of ASCII, DEL included.
constexpr bool is_control(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte < 0x20 || byte == 0x7F;
}

constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// An ASCII letter or digit.
constexpr bool is_alphanumeric(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

}  // namespace millrace::base::text
