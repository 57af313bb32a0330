#include "fabric/registry/heartbeats.hpp"

namespace millrace::fabric::registry {

void Heartbeats::note(const InstanceLoad& load) {
  const auto [entry, is_new] = known_.try_emplace(load.status.instance);
  if (is_new || entry->second.load != load) {
    entry->second = {load, number_};
  }
}

void Heartbeats::forget(const InstanceId& instance) {
  known_.erase(instance);
}

Heartbeat Heartbeats::next(Time now) {
  Heartbeat heartbeat{.process = process_, .at = now};
  std::size_t others = 0;
  // Each heartbeat begins behind the last one, so that all have their turn.
  auto next = known_.upper_bound(last_);
  for (std::size_t i = 0; i < known_.size() && heartbeat.loads.size() < most_loads; ++i, ++next) {
    next = next == known_.end() ? known_.begin() : next;
    const Known& known = next->second;
    const bool matters = !known.load.calls.empty() || known.changed + repeats > number_;
    if (matters || others < in_turn) {
      others += matters ? 0U : 1U;
      last_ = next->first;
      heartbeat.loads.push_back(known.load);
    }
  }
  ++number_;
  return heartbeat;
}

}  // namespace millrace::fabric::registry
