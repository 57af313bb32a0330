#include "cnc/ads/address.hpp"

#include <charconv>

#include <fmt/format.h>

namespace millrace::cnc::ads {

std::optional<NetId> NetId::parse(std::string_view text) {
  NetId id;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < id.bytes.size(); ++i) {
    if (i > 0 && (at == end || *at++ != '.')) {
      return std::nullopt;
    }
    const auto [next, error] = std::from_chars(at, end, id.bytes[i]);
    if (error != std::errc{}) {
      return std::nullopt;
    }
    at = next;
  }
  return at == end ? std::optional(id) : std::nullopt;
}

std::string NetId::to_string() const {
  return fmt::format("{}", fmt::join(bytes, "."));
}

}  // namespace millrace::cnc::ads
