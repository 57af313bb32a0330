// Which channels an instance serves, as text: on command lines and in its identity.
//
//   parse_channel_scope("cnc/1")   // {"cnc", 1}
//   parse_channel_scope("cnc/*")   // {"cnc", 0}: every channel of the machine
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "fabric/messages.hpp"

namespace millrace::fabric {

/// Limits of idl/millrace.idl.
inline constexpr std::size_t longest_machine_name = 63;

/// True for 1 to 63 letters, digits, '_' and '-' of ASCII.
bool is_machine_name(std::string_view name);

/// The machine name in the calls of a message queue: "press.alarms". A channel's Service Interface
/// and its queues so have different keys, "press/1" and "press.alarms/1".
std::string queue_owner(std::string_view machine, std::string_view queue);
/// "press" of both.
std::string_view machine_of(std::string_view owner);
/// "alarms"; empty if it is not a queue.
std::string_view queue_of(std::string_view owner);
/// A machine's name, or that of a queue of one.
bool is_channel_owner(std::string_view name);

/// "cnc/1", "cnc/*", "*/1" or "*/*"; a channel is 1 to 65535.
tl::expected<ChannelScope, std::string> parse_channel_scope(std::string_view text);
std::string format_channel_scope(const ChannelScope& scope);

/// Of two lists of a machine's channels, as configurations and claims have them: whether a channel
/// is in both. An empty list has all channels.
bool have_common_channel(const std::vector<std::uint16_t>& channels,
                         const std::vector<std::uint16_t>& others);

}  // namespace millrace::fabric
