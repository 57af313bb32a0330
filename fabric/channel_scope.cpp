#include "fabric/channel_scope.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/text/ascii.hpp"

namespace millrace::fabric {

bool is_machine_name(std::string_view name) {
  return !name.empty() && name.size() <= longest_machine_name &&
         std::ranges::all_of(
             name, [](char c) { return base::text::is_alphanumeric(c) || c == '_' || c == '-'; });
}

std::string queue_owner(std::string_view machine, std::string_view queue) {
  return fmt::format("{}.{}", machine, queue);
}

std::string_view machine_of(std::string_view owner) {
  return owner.substr(0, owner.find('.'));
}

std::string_view queue_of(std::string_view owner) {
  const auto dot = owner.find('.');
  return dot == std::string_view::npos ? std::string_view() : owner.substr(dot + 1);
}

bool is_channel_owner(std::string_view name) {
  const bool whole = name.size() <= longest_machine_name && is_machine_name(machine_of(name));
  return whole && (name.find('.') == std::string_view::npos || is_machine_name(queue_of(name)));
}

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
    scope.channel = base::text::parse_number<std::uint16_t>(channel).value_or(0);
  }
  if ((machine != "*" && !is_channel_owner(machine)) || (channel != "*" && scope.channel == 0)) {
    return tl::unexpected(fmt::format(
        "'{}' is not a channel; expected MACHINE/N, or MACHINE.QUEUE/N, either part may be *",
        text.substr(0, 2 * longest_machine_name)));
  }
  return scope;
}

std::string format_channel_scope(const ChannelScope& scope) {
  return fmt::format("{}/{}", scope.machine.empty() ? "*" : scope.machine,
                     scope.channel == 0 ? "*" : std::to_string(scope.channel));
}

bool have_common_channel(const std::vector<std::uint16_t>& channels,
                         const std::vector<std::uint16_t>& others) {
  return channels.empty() || others.empty() ||
         std::ranges::any_of(channels, [&](std::uint16_t channel) {
           return std::ranges::find(others, channel) != others.end();
         });
}

}  // namespace millrace::fabric
