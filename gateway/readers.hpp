// What somebody wants to hear of what channels say beside their work. What nobody hears is not put
// into words: to make a call's events, states and log lines, and to throw them away, costs a fifth
// of the call.
#pragma once

#include <cstdint>

namespace millrace::gateway {

enum class Level : std::uint8_t { debug, info, warn, error };

struct Readers {
  /// Somebody reads events.
  bool events = true;
  /// Somebody reads the states of channels.
  bool statuses = true;
  /// The log drops what is below.
  Level min_level = Level::debug;
  bool operator==(const Readers&) const = default;
};

}  // namespace millrace::gateway
