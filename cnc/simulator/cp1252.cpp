#include "cnc/simulator/cp1252.hpp"

#include <array>

namespace millrace::cnc::simulator {

namespace {

constexpr char16_t undefined = 0xFFFD;

/// Where CP1252 differs from Latin-1: 0x80 to 0x9F.
constexpr std::array<char16_t, 32> upper_controls{
    0x20AC,    undefined, 0x201A, 0x0192, 0x201E, 0x2026,    0x2020, 0x2021,
    0x02C6,    0x2030,    0x0160, 0x2039, 0x0152, undefined, 0x017D, undefined,
    undefined, 0x2018,    0x2019, 0x201C, 0x201D, 0x2022,    0x2013, 0x2014,
    0x02DC,    0x2122,    0x0161, 0x203A, 0x0153, undefined, 0x017E, 0x0178};

char16_t code_point(unsigned char byte) {
  constexpr unsigned char first = 0x80;
  const auto index = static_cast<std::size_t>(byte) - first;
  return byte >= first && index < upper_controls.size() ? upper_controls.at(index) : byte;
}

void append(std::string& out, char16_t point) {
  if (point < 0x80) {
    out += static_cast<char>(point);
  } else if (point < 0x800) {
    out += static_cast<char>(0xC0 | (point >> 6));
    out += static_cast<char>(0x80 | (point & 0x3F));
  } else {
    out += static_cast<char>(0xE0 | (point >> 12));
    out += static_cast<char>(0x80 | ((point >> 6) & 0x3F));
    out += static_cast<char>(0x80 | (point & 0x3F));
  }
}

}  // namespace

std::string utf8_of_cp1252(std::string_view text) {
  std::string out;
  for (const char character : text) {
    append(out, code_point(static_cast<unsigned char>(character)));
  }
  return out;
}

}  // namespace millrace::cnc::simulator
