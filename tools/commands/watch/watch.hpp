// `millrace watch`: the calls of a fabric as they go by.
#pragma once

#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::watch {

void add_watch(CLI::App& app, Chosen& chosen);

}  // namespace millrace::tools::commands::watch
