#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands {

CLI::App& add_subcommand(CLI::App& parent, const std::string& name, const std::string& description,
                         const std::string& example) {
  CLI::App* command = parent.add_subcommand(name, description);
  command->footer("Example:\n  " + example);
  return *command;
}

void add_json(CLI::App& command, bool& json) {
  command.add_flag("--json", json, "Print JSON");
}

}  // namespace millrace::tools::commands
