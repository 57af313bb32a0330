#include "tools/commands/look/look.hpp"

#include "tools/commands/arguments.hpp"

namespace millrace::tools::commands::look {

SnapshotOptions::SnapshotOptions(CLI::App& command)
    : fabric(command, {.name = "millrace"}), wait(bus::Patience{}.at_least) {
  add_duration(command, "--wait", wait,
               "Listen for at least this time; default 700ms. With trust up to 3s until all "
               "participants are authenticated");
}

fabric::plant::Plant SnapshotOptions::look() const {
  return bus::take_snapshot(fabric.options(), bus::patience_of(wait));
}

LookOptions::LookOptions(CLI::App& command, const std::string& what_name,
                         const std::string& what_help)
    : SnapshotOptions(command), output(command) {
  command.add_option(what_name, what, what_help);
}

}  // namespace millrace::tools::commands::look
