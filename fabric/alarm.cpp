#include "fabric/alarm.hpp"

#include <array>

#include "fabric/words.hpp"

namespace millrace::fabric {

std::string_view name_of(AlarmLevel level) {
  constexpr std::array<std::string_view, 3> names{"fine", "warning", "problem"};
  const auto index = static_cast<std::size_t>(level);
  return index < names.size() ? names.at(index) : unknown_word(static_cast<std::uint8_t>(index));
}

std::string shortened(std::string_view text, std::size_t most) {
  constexpr std::string_view more = " …";
  if (text.size() <= most) {
    return std::string(text);
  }
  std::size_t size = most - more.size();
  // 10xxxxxx: within a character.
  while (size > 0 && (static_cast<unsigned char>(text[size]) & 0xC0U) == 0x80U) {
    --size;
  }
  return std::string(text.substr(0, size)) + std::string(more);
}

}  // namespace millrace::fabric
