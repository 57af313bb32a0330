#include "fabric/channel_scope.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/text/characters.hpp"
#include "base/text/number.hpp"

namespace millrace::fabric {

bool is_machine_name(std::string_view name) {
  return !name.empty() && name.size() <= longest_machine_name &&
         std::ranges::all_of(
             name, [](char c) { return base::text::is_alphanumeric(c) || c == '_' || c == '-'; });
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
  if ((machine != "*" && !is_machine_name(machine)) || (channel != "*" && scope.channel == 0)) {
    return tl::unexpected(
        fmt::format("'{}' is no channel; expected MACHINE/N, either of them may be *",
                    text.substr(0, 2 * longest_machine_name)));
  }
  return scope;
}

std::string format_channel_scope(const ChannelScope& scope) {
  return fmt::format("{}/{}", scope.machine.empty() ? "*" : scope.machine,
                     scope.channel == 0 ? "*" : std::to_string(scope.channel));
}

}  // namespace millrace::fabric
