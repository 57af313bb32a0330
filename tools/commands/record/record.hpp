// `millrace record`: records a whole fabric into a file.
#pragma once

#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::record {

void add_record(CLI::App& app, Chosen& chosen);

}  // namespace millrace::tools::commands::record
