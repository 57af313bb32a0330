// `millrace data`, `millrace programs` and `millrace queues`: what gateways publish about their
// machines besides calls.
#pragma once

#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::data {

void add_data(CLI::App& app, Chosen& chosen);
void add_programs(CLI::App& app, Chosen& chosen);
void add_queues(CLI::App& app, Chosen& chosen);

}  // namespace millrace::tools::commands::data
