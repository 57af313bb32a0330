#include "tools/commands/look/watch.hpp"

#include <cstdio>
#include <optional>

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "tools/commands/screen.hpp"

namespace millrace::tools::commands::look {

WatchFlag::WatchFlag(CLI::App& command, const std::vector<std::string>& excluded) {
  CLI::Option* const flag = command.add_flag("--watch", on, "Show it again every second");
  for (const std::string& other : excluded) {
    flag->excludes(command.get_option(other));
  }
}

int watch(const SnapshotOptions& options,
          const std::function<std::string(const fabric::plant::Plant&)>& text_of) {
  std::optional<Screen> screen;
  if (output_is_terminal()) {
    screen.emplace();
  }
  bool is_first = true;
  bus::watch(options.fabric.options(), bus::patience_of(options.wait), std::chrono::seconds(1),
             [&](const fabric::plant::Plant& live) {
               const std::string text = text_of(live);
               if (screen) {
                 // A line after the last one would scroll.
                 Screen::draw(first_lines(text, Screen::size().rows - 1));
                 return true;
               }
               fmt::print("{}{}", is_first ? "" : "\n", text);
               is_first = false;
               return std::fflush(stdout) == 0;
             });
  return base::program::exit_done;
}

}  // namespace millrace::tools::commands::look
