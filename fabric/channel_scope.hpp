// Which channels an instance serves, as text: on command lines and in its identity.
//
//   parse_channel_scope("cnc/1")   // {"cnc", 1}
//   parse_channel_scope("cnc/*")   // {"cnc", 0}: every channel of the machine
#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "fabric/messages.hpp"

namespace millrace::fabric {

/// "cnc/1", "cnc/*", "*/1" or "*/*"; a machine is letters, digits, '_' and '-', at most 63, a
/// channel is 1 to 65535.
tl::expected<ChannelScope, std::string> parse_channel_scope(std::string_view text);
std::string format_channel_scope(const ChannelScope& scope);

}  // namespace millrace::fabric
