#include "base/text/cp1252.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include <fmt/format.h>

namespace millrace::base::text {

namespace {

/// Bytes 80 to 9F; all others are the code point of the same number.
constexpr std::array<char16_t, 32> high_controls{
    0x20AC, 0x0081, 0x201A, 0x0192, 0x201E, 0x2026, 0x2020, 0x2021, 0x02C6, 0x2030, 0x0160,
    0x2039, 0x0152, 0x008D, 0x017D, 0x008F, 0x0090, 0x2018, 0x2019, 0x201C, 0x201D, 0x2022,
    0x2013, 0x2014, 0x02DC, 0x2122, 0x0161, 0x203A, 0x0153, 0x009D, 0x017E, 0x0178};

char as_char(std::uint32_t byte) {
  return static_cast<char>(static_cast<std::uint8_t>(byte));
}

void append_utf8(std::string& out, char16_t code) {
  const std::uint32_t c = code;
  if (c < 0x80) {
    out += as_char(c);
  } else if (c < 0x800) {
    out += as_char(0xC0 | (c >> 6));
    out += as_char(0x80 | (c & 0x3F));
  } else {
    out += as_char(0xE0 | (c >> 12));
    out += as_char(0x80 | ((c >> 6) & 0x3F));
    out += as_char(0x80 | (c & 0x3F));
  }
}

/// Number of bytes of a UTF-8 character, by its first; 0 = invalid first byte.
std::size_t utf8_length(std::uint8_t first) {
  if (first < 0x80) {
    return 1;
  }
  if (first >= 0xC2 && first < 0xE0) {
    return 2;
  }
  if (first >= 0xE0 && first < 0xF0) {
    return 3;
  }
  return first >= 0xF0 && first < 0xF5 ? 4 : 0;
}

/// The code point in the first `length` bytes of `text`; nullopt if it is not valid UTF-8.
std::optional<std::uint32_t> decode(std::string_view text, std::size_t length) {
  if (length == 0 || text.size() < length) {
    return std::nullopt;
  }
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  std::uint32_t code = length == 1 ? byte(0) : byte(0) & (0x7FU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) {
      return std::nullopt;
    }
    code = (code << 6) | (byte(i) & 0x3FU);
  }
  // Overlong, a surrogate, or beyond Unicode. Two bytes cannot be overlong after C2.
  constexpr std::array<std::uint32_t, 5> smallest{0, 0, 0x80, 0x800, 0x10000};
  if (code < smallest.at(length) || (code >= 0xD800 && code < 0xE000) || code > 0x10FFFF) {
    return std::nullopt;
  }
  return code;
}

std::optional<char> encode(std::uint32_t code) {
  if (code < 0x80 || (code >= 0xA0 && code < 0x100)) {
    return as_char(code);
  }
  const auto found = std::find(high_controls.begin(), high_controls.end(), code);
  if (found == high_controls.end()) {
    return std::nullopt;
  }
  return as_char(0x80U + static_cast<std::uint32_t>(found - high_controls.begin()));
}

}  // namespace

std::string to_utf8(std::string_view cp1252) {
  std::string out;
  out.reserve(cp1252.size());
  for (const char c : cp1252) {
    const auto byte = static_cast<std::uint8_t>(c);
    append_utf8(out, byte >= 0x80 && byte < 0xA0 ? high_controls.at(byte - 0x80U) : byte);
  }
  return out;
}

tl::expected<std::string, std::string> to_cp1252(std::string_view utf8) {
  std::string out;
  out.reserve(utf8.size());
  for (std::size_t at = 0; at < utf8.size();) {
    const std::size_t length = utf8_length(static_cast<std::uint8_t>(utf8[at]));
    const auto code = decode(utf8.substr(at), length);
    if (!code) {
      return tl::unexpected(fmt::format("byte {} is not UTF-8", at + 1));
    }
    const auto byte = encode(*code);
    if (!byte) {
      return tl::unexpected(fmt::format("U+{:04X} at byte {} is not in CP1252", *code, at + 1));
    }
    out += *byte;
    at += length;
  }
  return out;
}

bool is_utf8(std::string_view text) {
  for (;;) {
    // Most texts are ASCII only.
    const auto* const other = std::find_if(text.begin(), text.end(), [](char c) {
      return (static_cast<std::uint8_t>(c) & 0x80U) != 0;
    });
    text.remove_prefix(static_cast<std::size_t>(other - text.begin()));
    if (text.empty()) {
      return true;
    }
    const std::size_t length = utf8_length(static_cast<std::uint8_t>(text.front()));
    if (!decode(text, length)) {
      return false;
    }
    text.remove_prefix(length);
  }
}

}  // namespace millrace::base::text
