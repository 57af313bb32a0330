// `millrace trust`: who may be what on a fabric. Makes and keeps the credentials that proves it.
#pragma once

#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::trust {

void add_trust(CLI::App& app, Chosen& chosen);

}  // namespace millrace::tools::commands::trust
