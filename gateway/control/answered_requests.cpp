#include "gateway/control/answered_requests.hpp"

namespace millrace::gateway::control {

void AnsweredRequests::keep(const fabric::ChannelKey& key, const std::string& uuid,
                            SteadyTime now) {
  left_.insert_or_assign(key, Left{uuid, now});
  if (!sweep_) {
    sweep_ = now + quiet;
  }
}

std::optional<std::string> AnsweredRequests::replace(const fabric::ChannelKey& key,
                                                     const std::string& uuid) {
  const auto left = left_.find(key);
  if (left == left_.end()) {
    return {};
  }
  std::optional<std::string> old;
  if (left->second.uuid != uuid) {
    old = std::move(left->second.uuid);
  }
  left_.erase(left);
  return old;
}

std::optional<std::string> AnsweredRequests::take(const fabric::ChannelKey& key) {
  auto left = left_.extract(key);
  return left.empty() ? std::nullopt : std::optional(std::move(left.mapped().uuid));
}

std::vector<std::pair<fabric::ChannelKey, std::string>> AnsweredRequests::take_all() {
  std::vector<std::pair<fabric::ChannelKey, std::string>> taken;
  for (auto& [key, left] : left_) {
    taken.emplace_back(key, std::move(left.uuid));
  }
  left_.clear();
  sweep_.reset();
  return taken;
}

std::vector<std::pair<fabric::ChannelKey, std::string>> AnsweredRequests::due(SteadyTime now) {
  std::vector<std::pair<fabric::ChannelKey, std::string>> taken;
  if (!sweep_ || now < *sweep_) {
    return taken;
  }
  for (auto it = left_.begin(); it != left_.end();) {
    if (it->second.since + quiet <= now) {
      taken.emplace_back(it->first, std::move(it->second.uuid));
      it = left_.erase(it);
    } else {
      ++it;
    }
  }
  sweep_ = left_.empty() ? std::nullopt : std::optional(now + quiet);
  return taken;
}

}  // namespace millrace::gateway::control
