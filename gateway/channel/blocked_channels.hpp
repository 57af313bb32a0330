// Since when channels stand, and why: held for an operator, or left alone. The journal knows it, so
// that a gateway that starts anew shows the same. Pure.
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

  /// What the journal knows.
  void resume(std::map<fabric::ChannelKey, BlockedEntry> known) { entries_ = std::move(known); }
  /// Remembers that the channel stands, or that it does not any more. A journal that is full says
  /// so itself, and is no place for this: then `begins` is false, and nothing new is remembered.
  void note(const fabric::ChannelStatus& status, bool begins, Moment now);
  void forget(const fabric::ChannelKey& key);
  /// What it is remembered to stand for, if that is the same; nullptr if not.
  [[nodiscard]] const BlockedEntry* of(const fabric::ChannelStatus& status) const;

 private:
  Outputs& port_;
  std::map<fabric::ChannelKey, BlockedEntry> entries_;
};

}  // namespace millrace::gateway::channel
