// Numbers as text, independent of the locale.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>

namespace millrace::base::text {

/// The whole of `text` as a number in `base`; nullopt if it is not a number, has trailing
/// characters or is out of range.
template <typename Number>
std::optional<Number> parse_number(std::string_view text, int base = 10) {
  Number number{};
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number, base);
  return error == std::errc{} && end == last ? std::optional(number) : std::nullopt;
}

}  // namespace millrace::base::text
