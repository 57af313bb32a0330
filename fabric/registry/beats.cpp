#include "fabric/registry/beats.hpp"

namespace millrace::fabric::registry {

void Beats::note(const InstanceLoad& load) {
  const auto [entry, is_new] = known_.try_emplace(load.status.instance);
  if (is_new || entry->second.load != load) {
    entry->second = {load, number_};
  }
}

void Beats::forget(const InstanceId& instance) {
  known_.erase(instance);
}

Beat Beats::next(Time now) {
  Beat beat{.member = member_, .at = now};
  std::size_t others = 0;
  // Each beat begins behind the last one, so that all have their turn.
  auto one = known_.upper_bound(last_);
  for (std::size_t i = 0; i < known_.size() && beat.loads.size() < most_loads; ++i, ++one) {
    one = one == known_.end() ? known_.begin() : one;
    const Known& known = one->second;
    const bool matters = !known.load.calls.empty() || known.changed + told > number_;
    if (matters || others < in_turn) {
      others += matters ? 0U : 1U;
      last_ = one->first;
      beat.loads.push_back(known.load);
    }
  }
  ++number_;
  return beat;
}

}  // namespace millrace::fabric::registry
