// The warning of a command before it connects to a controller over ADS.
#pragma once

#include "gateway/settings/settings.hpp"

namespace millrace::tools::commands {

/// One connection per host is a rule of TwinCAT's router. The warning goes to standard error,
/// unless the controller is on this host and therefore a virtual one.
void warn_of_the_one_connection(const gateway::settings::MachineSettings& machine);

}  // namespace millrace::tools::commands
