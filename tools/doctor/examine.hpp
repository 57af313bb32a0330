// Joins a fabric, looks around for some seconds, asks everybody for the time, and leaves.
#pragma once

#include <chrono>
#include <vector>

#include "fabric/dds/participant.hpp"
#include "tools/doctor/findings.hpp"

namespace millrace::tools::doctor {

struct Examination {
  fabric::dds::ParticipantOptions join{};
  /// What the fabric's file says beyond that.
  Joining joining{};
  /// How long to listen. Everybody announces himself at least once per lease, half a second unless
  /// configured.
  std::chrono::milliseconds listen{2000};
  /// What somebody who has looked for longer knows: an examination sees no trace of what was gone
  /// before it.
  std::vector<bus::LostMachine> lost{};
};

/// Throws nothing that a network or a configuration can cause: that is a finding.
Findings examine(const Examination& examination);

}  // namespace millrace::tools::doctor
