// The LCM channels between the bridge and the LCM processes.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "fabric/lcm/packet.hpp"

namespace millrace::services::lcm {

/// From all LCM processes.
inline constexpr std::string_view presence_channel = "MILLRACE_PRESENCE";

// Followed by the canonical UUID. To its processes:
inline constexpr std::string_view request_prefix = "MILLRACE_REQUEST.";
inline constexpr std::string_view withdrawal_prefix = "MILLRACE_WITHDRAWAL.";
inline constexpr std::string_view drain_prefix = "MILLRACE_DRAIN.";
// From them:
inline constexpr std::string_view reply_prefix = "MILLRACE_REPLY.";

/// Bytes of an identifier that fits into a channel's name.
inline constexpr std::size_t longest_uuid = fabric::lcm::longest_channel - withdrawal_prefix.size();

inline std::string channel_of(std::string_view prefix, std::string_view uuid) {
  return std::string(prefix).append(uuid);
}

}  // namespace millrace::services::lcm
