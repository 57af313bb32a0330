// `millrace status`: what needs attention, one line per machine, an exit code for monitors.
#pragma once

#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::status {

void add_status(CLI::App& app, Chosen& chosen);

}  // namespace millrace::tools::commands::status
