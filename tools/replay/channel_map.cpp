#include "tools/replay/channel_map.hpp"

#include <fmt/format.h>

#include "base/text/number.hpp"
#include "fabric/channel_scope.hpp"

namespace millrace::tools::replay {

namespace {

std::optional<fabric::ChannelKey> parse_channel(std::string_view text) {
  const std::size_t slash = text.rfind('/');
  const std::string_view machine = text.substr(0, slash);
  if (slash == std::string_view::npos || !fabric::is_channel_owner(machine)) {
    return std::nullopt;
  }
  const auto number = base::text::parse_number<std::uint16_t>(text.substr(slash + 1));
  return number.value_or(0) != 0 ? std::optional(fabric::ChannelKey{std::string(machine), *number})
                                 : std::nullopt;
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
    if (fabric::is_machine_name(left) && fabric::is_machine_name(right)) {
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
  // A queue follows its machine.
  const std::string_view queue = fabric::queue_of(recorded.machine);
  if (const auto machine = machines_.find(std::string(fabric::machine_of(recorded.machine)));
      !queue.empty() && machine != machines_.end()) {
    return fabric::ChannelKey{fabric::queue_owner(machine->second, queue), recorded.channel};
  }
  return std::nullopt;
}

}  // namespace millrace::tools::replay
