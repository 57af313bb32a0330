#include "gateway/core/timers.hpp"

#include <tuple>

namespace millrace::gateway::core {

/// Of channels that are due together the order is always the same.
bool Timers::Before::operator()(const Due& a, const Due& b) const {
  return std::tie(a.first, *a.second) < std::tie(b.first, *b.second);
}

void Timers::set(const fabric::ChannelKey& key, SteadyTime at) {
  const auto [found, is_new] = times_.try_emplace(key, at);
  if (!is_new) {
    if (found->second <= at) {
      return;
    }
    order_.erase({found->second, &found->first});
    found->second = at;
  }
  order_.emplace(at, &found->first);
}

void Timers::remove(const fabric::ChannelKey& key) {
  if (const auto found = times_.find(key); found != times_.end()) {
    order_.erase({found->second, &found->first});
    times_.erase(found);
  }
}

std::optional<SteadyTime> Timers::next() const {
  return order_.empty() ? std::nullopt : std::optional(order_.begin()->first);
}

std::vector<fabric::ChannelKey> Timers::take_due(SteadyTime now) {
  std::vector<fabric::ChannelKey> due;
  while (!order_.empty() && order_.begin()->first <= now) {
    due.push_back(*order_.begin()->second);
    order_.erase(order_.begin());
    times_.erase(due.back());
  }
  return due;
}

}  // namespace millrace::gateway::core
