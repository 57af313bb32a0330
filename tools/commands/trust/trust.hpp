// `millrace trust`: the roles of participants on a fabric. Creates and keeps their credentials.
#pragma once

#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::trust {

void add_trust(CLI::App& app, Chosen& chosen);

}  // namespace millrace::tools::commands::trust
