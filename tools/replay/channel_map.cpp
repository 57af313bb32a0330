#include "tools/replay/channel_map.hpp"

#include <charconv>

#include <fmt/format.h>

namespace millrace::tools::replay {

namespace {

/// What idl/millrace.idl has room for.
constexpr std::size_t longest_name = 63;

std::optional<fabric::ChannelKey> parse_channel(std::string_view text) {
  const std::size_t slash = text.rfind('/');
  if (slash == std::string_view::npos || slash == 0 || slash > longest_name) {
    return std::nullopt;
  }
  fabric::ChannelKey key{std::string(text.substr(0, slash)), 0};
  const std::string_view number = text.substr(slash + 1);
  const auto [end, error] =
      std::from_chars(number.data(), number.data() + number.size(), key.channel);
  if (error != std::errc{} || end != number.data() + number.size() || key.channel == 0) {
    return std::nullopt;
  }
  return key;
}

bool is_machine(std::string_view text) {
  return !text.empty() && text.size() <= longest_name && text.find('/') == std::string_view::npos;
}

}  // namespace

tl::expected<void, std::string> ChannelMap::add(std::string_view text) {
  const std::size_t equals = text.find('=');
  if (equals != std::string_view::npos) {
    const std::string_view left = text.substr(0, equals);
    const std::string_view right = text.substr(equals + 1);
    const auto from = parse_channel(left);
    const auto to = parse_channel(right);
    if (from && to) {
      channels_.insert_or_assign(*from, *to);
      return {};
    }
    if (is_machine(left) && is_machine(right)) {
      machines_.insert_or_assign(std::string(left), std::string(right));
      return {};
    }
  }
  return tl::unexpected(fmt::format(
      "'{}' maps no channel; expected RECORDED=OTHER, as in cnc/1=test/7 or cnc=test", text));
}

std::optional<fabric::ChannelKey> ChannelMap::find(const fabric::ChannelKey& recorded) const {
  if (const auto channel = channels_.find(recorded); channel != channels_.end()) {
    return channel->second;
  }
  if (const auto machine = machines_.find(recorded.machine); machine != machines_.end()) {
    return fabric::ChannelKey{machine->second, recorded.channel};
  }
  return std::nullopt;
}

}  // namespace millrace::tools::replay
