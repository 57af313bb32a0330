#include "gateway/core/predecessor_calls.hpp"

#include <utility>

namespace millrace::gateway::core {

void PredecessorCalls::add(const fabric::ChannelKey& key, PredecessorCall call) {
  const std::string uuid = fabric::canonical_uuid(call.uuid);
  auto& of_channel = calls_[key];
  if (of_channel.size() < most_per_channel || of_channel.contains(uuid)) {
    of_channel.insert_or_assign(uuid, std::move(call));
  }
}

void PredecessorCalls::on_read_started(const fabric::ChannelKey& key) {
  if (const auto found = calls_.find(key); found != calls_.end()) {
    for (auto& [uuid, call] : found->second) {
      call.read_since = true;
    }
  }
}

template <typename Over>
void PredecessorCalls::erase_if(const fabric::ChannelKey& key, Over over) {
  if (const auto found = calls_.find(key); found != calls_.end()) {
    std::erase_if(found->second, [&](const auto& entry) { return over(entry.second); });
    if (found->second.empty()) {
      calls_.erase(found);
    }
  }
}

void PredecessorCalls::on_zero_read(const fabric::ChannelKey& key) {
  erase_if(key, [](const PredecessorCall& predecessor) { return predecessor.read_since; });
}

void PredecessorCalls::on_answered(const fabric::ChannelKey& key, const fabric::CallId& call) {
  erase_if(key, [&](const PredecessorCall& predecessor) { return predecessor.call == call; });
}

std::optional<PredecessorCall> PredecessorCalls::take(const fabric::ChannelKey& key,
                                                      const std::string& canonical_uuid) {
  const auto found = calls_.find(key);
  if (found == calls_.end()) {
    return std::nullopt;
  }
  auto taken = found->second.extract(canonical_uuid);
  on_zero_read(key);
  return taken.empty() ? std::nullopt : std::optional(std::move(taken.mapped()));
}

}  // namespace millrace::gateway::core
