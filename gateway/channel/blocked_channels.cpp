#include "gateway/channel/blocked_channels.hpp"

#include <utility>

namespace millrace::gateway::channel {

void BlockedChannels::note(const fabric::ChannelStatus& status, bool begins, Moment now) {
  using enum fabric::ChannelState;
  if (status.state == held || status.state == unserved) {
    if (begins && of(status) == nullptr) {
      BlockedEntry entry{.key = status.key,
                         .state = status.state,
                         .call = status.call,
                         .uuid = status.uuid,
                         .since = now.wall,
                         .reason = {status.cause, status.reason}};
      port_.append(entry, {});
      entries_.insert_or_assign(status.key, std::move(entry));
    }
  } else if (const auto found = entries_.find(status.key); found != entries_.end() &&
                                                           status.call != fabric::CallId{} &&
                                                           status.call != found->second.call) {
    forget(status.key);
  }
}

void BlockedChannels::forget(const fabric::ChannelKey& key) {
  if (!entries_.empty() && entries_.erase(key) != 0) {
    port_.append(BlockedEntry{.key = key}, {});
  }
}

const BlockedEntry* BlockedChannels::of(const fabric::ChannelStatus& status) const {
  const auto found = entries_.find(status.key);
  const bool same = found != entries_.end() && found->second.state == status.state &&
                    found->second.call == status.call && found->second.uuid == status.uuid;
  return same ? &found->second : nullptr;
}

}  // namespace millrace::gateway::channel
