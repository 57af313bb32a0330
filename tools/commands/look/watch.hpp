// `--watch` of a command that shows a fabric.
#pragma once

#include <functional>
#include <string>

#include "fabric/plant/plant.hpp"
#include "tools/commands/look/look.hpp"

namespace millrace::tools::commands::look {

struct WatchFlag {
  /// Adds the flag to `command`; it excludes other forms of output.
  explicit WatchFlag(CLI::App& command, const std::vector<std::string>& excluded);

  bool on = false;
};

/// Shows the text of the fabric again every second until SIGINT, SIGTERM or the end of the output's
/// reader. A terminal is redrawn and shows the first lines; elsewhere an empty line is between two
/// texts. The exit code.
int watch(const SnapshotOptions& options,
          const std::function<std::string(const fabric::plant::Plant&)>& text_of);

}  // namespace millrace::tools::commands::look
