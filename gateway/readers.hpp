// Who reads what channels publish and log. What nobody reads is not made: to make the events, states
// and log lines of a call, and to throw them away, costs a fifth of the call.
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
