#include "fabric/channel_scope.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>

#include <fmt/format.h>

namespace millrace::fabric {

namespace {

/// 0 if `text` is no channel number.
std::uint16_t parse_channel(std::string_view text) {
  std::uint16_t number = 0;
  const auto [end, error] = std::from_chars(text.begin(), text.end(), number);
  return error == std::errc() && end == text.end() ? number : std::uint16_t{0};
}

bool is_machine_name(std::string_view name) {
  return !name.empty() && name.size() <= 63 && std::all_of(name.begin(), name.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
  });
}

}  // namespace

tl::expected<ChannelScope, std::string> parse_channel_scope(std::string_view text) {
  const auto slash = text.find('/');
  const std::string_view machine = text.substr(0, slash);
  const std::string_view channel =
      slash == std::string_view::npos ? std::string_view{} : text.substr(slash + 1);
  ChannelScope scope;
  if (machine != "*") {
    scope.machine = machine;
  }
  if (channel != "*") {
    scope.channel = parse_channel(channel);
  }
  if ((machine != "*" && !is_machine_name(machine)) || (channel != "*" && scope.channel == 0)) {
    return tl::unexpected(
        fmt::format("'{}' is no channel; expected MACHINE/N, either of them may be *", text));
  }
  return scope;
}

std::string format_channel_scope(const ChannelScope& scope) {
  return fmt::format("{}/{}", scope.machine.empty() ? "*" : scope.machine,
                     scope.channel == 0 ? "*" : std::to_string(scope.channel));
}

}  // namespace millrace::fabric
