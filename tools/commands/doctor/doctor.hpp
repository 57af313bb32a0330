// `millrace doctor`: finds problems of a fabric, and what to do about them.
#pragma once

#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::doctor {

void add_doctor(CLI::App& app, Chosen& chosen);

}  // namespace millrace::tools::commands::doctor
