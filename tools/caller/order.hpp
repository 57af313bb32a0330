// A call of a tool, and its end.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "fabric/messages.hpp"

namespace millrace::tools::caller {

/// A call that no controller made.
struct Order {
  /// Its key on the fabric. One call at a time, as in a channel of a controller; no other process
  /// may use the same channel (see reason_taken).
  fabric::ChannelKey key{};
  /// The channel for which an instance is chosen by its scope; `key` unless given.
  std::optional<fabric::ChannelKey> as{};
  std::string uuid{};
  /// At most 127 bytes in CP1252.
  std::string text{};
  /// REQUEST_STATE; not 0.
  std::uint32_t state = 1;
  /// From the order to the final reply; zero = for ever.
  std::chrono::nanoseconds patience{};
  /// Comes from a recording.
  bool replayed = false;
};

/// How a call ended.
struct Ended {
  fabric::CallId call{};
  fabric::ChannelKey key{};
  /// The final reply; nullopt if none came.
  std::optional<fabric::Reply> reply{};
  /// Why there is none.
  fabric::Message reason{};
  /// Since the call was first dispatched; zero if it never was.
  std::chrono::nanoseconds took{};
};

}  // namespace millrace::tools::caller
