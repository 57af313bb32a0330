// Joins a fabric, listens for some seconds, compares the clocks of all hosts, and leaves.
#pragma once

#include <chrono>
#include <vector>

#include "fabric/dds/participant.hpp"
#include "tools/doctor/findings.hpp"

namespace millrace::tools::doctor {

struct Examination {
  fabric::dds::ParticipantOptions join{};
  /// The further contents of the fabric's file.
  Joining joining{};
  /// How long to listen. Each process announces itself at least once per lease, half a second
  /// unless configured.
  std::chrono::milliseconds listen{2000};
  /// Gateways that were gone before the examination, from a process that has listened for longer.
  std::vector<fabric::plant::LostMachine> lost{};
};

/// A fault of the network or configuration is a finding, not an exception.
Findings examine(const Examination& examination);

}  // namespace millrace::tools::doctor
