// Joins a fabric, listens until no new process comes (ListeningTime), and leaves.
#pragma once

#include <functional>

#include "fabric/dds/participant.hpp"
#include "tools/bus/fabric_model.hpp"
#include "tools/bus/listening_time.hpp"

namespace millrace::tools::bus {

/// Ends sooner once `enough` returns true, which is called after each change. Throws
/// std::runtime_error if the fabric cannot be joined.
FabricModel take_snapshot(
    const fabric::dds::ParticipantOptions& options, Patience patience = {},
    const std::function<bool(const FabricModel&)>& enough = [](const FabricModel&) {
      return false;
    });

}  // namespace millrace::tools::bus
