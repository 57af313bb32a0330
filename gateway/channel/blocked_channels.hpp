// Since when channels are blocked, and why: they wait for an operator, or no service has the UUID.
// The journal stores it, so that a restarted gateway shows the same. Pure.
//
//   blocked.note(status, now);
//   if (const BlockedEntry* entry = blocked.of(status)) …
#pragma once

#include <map>

#include "gateway/moment.hpp"
#include "gateway/outputs.hpp"

namespace millrace::gateway::channel {

class BlockedChannels {
 public:
  explicit BlockedChannels(Outputs& port) : port_(port) {}

  /// Takes over the entries of the journal.
  void resume(std::map<fabric::ChannelKey, BlockedEntry> known) { entries_ = std::move(known); }
  /// Stores that the channel is blocked, or that it is not any more. With `begins` false nothing
  /// new is stored: a full journal raises its own alarm.
  void note(const fabric::ChannelStatus& status, bool begins, Moment now);
  void forget(const fabric::ChannelKey& key);
  /// The stored entry for the same cause; nullptr if there is none.
  [[nodiscard]] const BlockedEntry* of(const fabric::ChannelStatus& status) const;

 private:
  Outputs& port_;
  std::map<fabric::ChannelKey, BlockedEntry> entries_;
};

}  // namespace millrace::gateway::channel
