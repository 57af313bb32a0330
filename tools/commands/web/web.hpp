// `millrace web`: the web page and the metrics for Prometheus.
#pragma once

#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::web {

void add_web(CLI::App& app, Chosen& chosen);

}  // namespace millrace::tools::commands::web
