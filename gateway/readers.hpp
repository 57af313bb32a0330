// Which outputs of channels have readers. Without a reader they are not made: to make the events,
// states and log lines of a call and to discard them costs a fifth of the call.
#pragma once

#include <cstdint>

namespace millrace::gateway {

enum class Level : std::uint8_t { debug, info, warn, error };

struct Readers {
  /// Events have a reader.
  bool events = true;
  /// The states of channels have a reader.
  bool statuses = true;
  /// The log drops what is below.
  Level min_level = Level::debug;
  bool operator==(const Readers&) const = default;
};

}  // namespace millrace::gateway
