// `millrace doctor`: who is seen on the fabric, who is not and why, and what to do about it.
#pragma once

#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::doctor {

void add_doctor(CLI::App& app, Chosen& chosen);

}  // namespace millrace::tools::commands::doctor
