// millrace lint: checks NC programs before they run.
#pragma once

#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::lint {

void add_lint(CLI::App& app, Chosen& chosen);

}  // namespace millrace::tools::commands::lint
