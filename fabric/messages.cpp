#include "fabric/messages.hpp"

#include <algorithm>
#include <cctype>
#include <random>
#include <utility>

#include <fmt/format.h>

#include "base/text/ascii.hpp"

namespace millrace::fabric {

namespace {

/// The hyphens of "560aacbf-6335-44a9-895a-8b27f3ed5e47".
bool is_hyphen_place(std::size_t index) {
  return index == 8 || index == 13 || index == 18 || index == 23;
}

bool is_hex(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}

std::uint8_t hex_value(char c) {
  const auto lower = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return static_cast<std::uint8_t>(lower <= '9' ? lower - '0' : lower - 'a' + 10);
}

}  // namespace

Reply reply_to(const Request& request, std::string text, std::uint32_t state) {
  return {.key = request.key,
          .instance = request.assigned,
          .call = request.call,
          .attempt = request.attempt,
          .text = std::move(text),
          .state = state,
          .asked_text = request.text,
          .asked_state = request.state,
          .replayed = request.replayed};
}

std::string ChannelKey::to_string() const {
  return fmt::format("{}/{}", machine, channel);
}

std::string CallId::to_string() const {
  return fmt::format("{:x}-{}", epoch, number);
}

std::string InstanceId::to_string() const {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    if (is_hyphen_place(text.size())) {
      text += '-';
    }
    text += fmt::format("{:02x}", byte);
  }
  return text;
}

std::optional<InstanceId> InstanceId::parse(std::string_view text) {
  if (!is_uuid(text)) {
    return std::nullopt;
  }
  InstanceId id;
  std::size_t digit = 0;
  for (const char c : text) {
    if (c != '-') {
      auto& byte = id.bytes[digit / 2];
      byte = static_cast<std::uint8_t>(byte << 4U | hex_value(c));
      ++digit;
    }
  }
  return id;
}

InstanceId InstanceId::random() {
  std::random_device source;
  InstanceId id;
  std::generate(id.bytes.begin(), id.bytes.end(),
                [&] { return static_cast<std::uint8_t>(source()); });
  // RFC 4122, 4.4: version 4, variant 10x.
  id.bytes[6] = static_cast<std::uint8_t>((id.bytes[6] & 0x0fU) | 0x40U);
  id.bytes[8] = static_cast<std::uint8_t>((id.bytes[8] & 0x3fU) | 0x80U);
  return id;
}

bool is_uuid(std::string_view text) {
  if (text.size() != 36) {
    return false;
  }
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (is_hyphen_place(i) ? text[i] != '-' : !is_hex(text[i])) {
      return false;
    }
  }
  return true;
}

std::string canonical_uuid(std::string_view text) {
  const std::string_view trimmed = base::text::trim(text);
  std::string_view inner = trimmed;
  if (inner.size() >= 2 && inner.front() == '{' && inner.back() == '}') {
    inner = base::text::trim(inner.substr(1, inner.size() - 2));
  }
  if (!is_uuid(inner)) {
    return std::string(trimmed);
  }
  std::string lower(inner);
  std::ranges::transform(lower, lower.begin(), [](char c) {
    return c >= 'A' && c <= 'F' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return lower;
}

std::optional<CallId> parse_call_id(std::string_view text) {
  const std::size_t dash = text.find('-');
  if (dash == std::string_view::npos) {
    return std::nullopt;
  }
  const auto epoch = base::text::parse_number<std::uint64_t>(text.substr(0, dash), 16);
  const auto number = base::text::parse_number<std::uint64_t>(text.substr(dash + 1));
  return epoch && number ? std::optional(CallId{*epoch, *number}) : std::nullopt;
}

}  // namespace millrace::fabric
