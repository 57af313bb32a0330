// What of a plant is wrong: the only place that judges its states. Pure.
//
//   for (const Concern& concern : assess(plant, now, {.flags = " --domain 7"})) …   // the worst first
#pragma once

#include <string>
#include <vector>

#include "fabric/plant/channel_view.hpp"
#include "fabric/plant/concern.hpp"
#include "fabric/plant/plant.hpp"

namespace millrace::fabric::plant {

struct View {
  /// For suggested commands (fabric::profile::given_flags).
  std::string flags{};
  Patience patience{};
};

/// One concern for each cause: a gateway that is gone is one with all of its machines, a service
/// without an instance one with all channels that wait for it. Sorted.
std::vector<Concern> assess(const Plant& plant, Time now, const View& view = {});
/// By level, then by urgency and age.
void sort(std::vector<Concern>& concerns);

/// The worst level; fine if there is none.
Level level_of(const std::vector<Concern>& concerns);

}  // namespace millrace::fabric::plant
