// `millrace replay`: a recording instead of machines, services or a controller.
#pragma once

#include "tools/commands/replay/options.hpp"
#include "tools/commands/replay/report.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/replay/plan.hpp"

namespace millrace::tools::commands::replay {

void add_replay(CLI::App& app, Chosen& chosen);

// One source file for each kind. Each returns the exit code.
int to_services(const Options& options, const tools::replay::Plan& plan);
int as_service(const Options& options, const tools::replay::Plan& plan);
int as_cnc(const Options& options, const tools::replay::Plan& plan);
int data(const Options& options);

}  // namespace millrace::tools::commands::replay
