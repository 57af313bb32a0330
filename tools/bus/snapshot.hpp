// One look at a fabric: joins it, listens until nobody new comes, and leaves.
#pragma once

#include <chrono>
#include <functional>

#include "fabric/dds/participant.hpp"
#include "tools/bus/live.hpp"

namespace millrace::tools::bus {

struct Patience {
  /// Listens at least this long: everybody who is there has announced himself by then.
  std::chrono::milliseconds at_least{700};
  /// And until nobody new came for this long.
  std::chrono::milliseconds quiet{200};
  std::chrono::milliseconds at_most{5000};
  /// With trust: the longest wait for announced participants to be authenticated. A participant of
  /// another plant never is.
  std::chrono::milliseconds proof{3000};
};

/// Ends sooner once `enough` says so, after each change. Throws std::runtime_error if the fabric
/// cannot be joined.
Live take_snapshot(
    const fabric::dds::ParticipantOptions& options, Patience patience = {},
    const std::function<bool(const Live&)>& enough = [](const Live&) { return false; });

}  // namespace millrace::tools::bus
