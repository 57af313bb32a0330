// Checks at each controller the variables that the configuration names, before a gateway uses them.
#pragma once

#include <string>
#include <vector>

#include "gateway/settings/settings.hpp"

namespace millrace::gateway::shell {

struct ControllerCheck {
  /// One line for each variable that a controller does not have, or that cannot be read.
  std::vector<std::string> mistakes;
  /// Controllers that did not respond, and why: a line each.
  std::vector<std::string> silent;
};

/// Connects to each machine with data, one after the other, and disconnects. A TwinCAT router keeps
/// one connection for each host: the link of a gateway on this host breaks for a moment.
ControllerCheck check_controllers(const std::vector<settings::MachineSettings>& machines);

}  // namespace millrace::gateway::shell
