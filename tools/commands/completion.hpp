// `millrace completion`: a script with which a shell completes subcommands and options.
#pragma once

#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands {

/// Describes the command line `app`, so it is added last.
void add_completion(CLI::App& app, Chosen& chosen);

}  // namespace millrace::tools::commands
