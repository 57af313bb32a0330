// millrace controller: finds controllers on a network, checks what one offers to a gateway, and
// adds a route to this host.
#pragma once

#include <CLI/App.hpp>

#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::controller {

void add_controller(CLI::App& app, Chosen& chosen);

void add_find(CLI::App& controller, Chosen& chosen);
void add_probe(CLI::App& controller, Chosen& chosen);
void add_route(CLI::App& controller, Chosen& chosen);

}  // namespace millrace::tools::commands::controller
