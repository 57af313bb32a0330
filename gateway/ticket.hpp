// Who waits until a journal entry is safe.
#pragma once

#include <cstdint>

#include "fabric/messages.hpp"

namespace millrace::gateway {

/// Handed over with an entry, and handed back once it is as safe as the journal's policy promises.
struct Ticket {
  enum class Of : std::uint8_t { nobody, numbers, channel, queue };

  Of of = Of::nobody;
  fabric::ChannelKey key{};
  /// Of a channel the count of its entries; of a queue which one of this key it is.
  std::uint64_t number = 0;

  explicit operator bool() const { return of != Of::nobody; }
  bool operator==(const Ticket&) const = default;
};

}  // namespace millrace::gateway
