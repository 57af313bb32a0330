#include "base/text/controls.hpp"

#include <array>

namespace millrace::base::text {

std::optional<Control> control_at(std::string_view utf8) {
  struct Range {
    std::string_view first;
    std::string_view last;
  };
  // As UTF-8, whose bytes have the order of the characters.
  static constexpr std::array<Range, 5> ranges{{
      {"\xC2\x80", "\xC2\x9F"},          // C1
      {"\xD8\x9C", "\xD8\x9C"},          // Arabic letter mark
      {"\xE2\x80\x8E", "\xE2\x80\x8F"},  // direction marks
      {"\xE2\x80\xA8", "\xE2\x80\xAE"},  // line and paragraph separators, embeddings, overrides
      {"\xE2\x81\xA6", "\xE2\x81\xA9"},  // isolates
  }};
  const auto byte = static_cast<std::uint8_t>(utf8.empty() ? ' ' : utf8.front());
  if (byte < 0x80) {
    return byte < 0x20 || byte == 0x7F ? std::optional(Control{1, byte}) : std::nullopt;
  }
  for (const Range& range : ranges) {
    const std::string_view character = utf8.substr(0, range.first.size());
    if (character.size() == range.first.size() && character >= range.first &&
        character <= range.last) {
      const auto bits = [&character](std::size_t i) {
        return static_cast<std::uint32_t>(static_cast<std::uint8_t>(character[i]) & 0x3FU);
      };
      return Control{character.size(), character.size() == 2
                                           ? (bits(0) & 0x1FU) << 6U | bits(1)
                                           : (bits(0) & 0x0FU) << 12U | bits(1) << 6U | bits(2)};
    }
  }
  return std::nullopt;
}

}  // namespace millrace::base::text
