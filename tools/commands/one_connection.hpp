// What a command says before it speaks ADS to a controller.
#pragma once

#include "gateway/settings/settings.hpp"

namespace millrace::tools::commands {

/// One connection per host is a rule of TwinCAT's router. Says so on standard error, unless the
/// controller is on this host, where it is a virtual one.
void warn_of_the_one_connection(const gateway::settings::MachineSettings& machine);

}  // namespace millrace::tools::commands
