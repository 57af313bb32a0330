// `millrace completion`: a script with which a shell completes subcommands and options.
#pragma once

#include <string>

#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands {

/// Describes the command line `app`, so it is added last.
void add_completion(CLI::App& app, Chosen& chosen);

/// The script for "bash", "zsh" or "fish".
std::string completion_script(const CLI::App& app, const std::string& shell);

}  // namespace millrace::tools::commands
