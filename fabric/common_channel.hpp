// Lists of a machine's channels, as configurations and claims have them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace millrace::fabric {

/// Whether a channel is in both lists; an empty list has all channels of the machine.
inline bool have_common_channel(const std::vector<std::uint16_t>& channels,
                                const std::vector<std::uint16_t>& others) {
  return channels.empty() || others.empty() ||
         std::ranges::any_of(channels, [&](std::uint16_t channel) {
           return std::ranges::find(others, channel) != others.end();
         });
}

}  // namespace millrace::fabric
