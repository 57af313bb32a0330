#include "tools/commands/completion.hpp"

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/program/completion.hpp"

namespace millrace::tools::commands {

void add_completion(CLI::App& app, Chosen& chosen) {
  auto shell = std::make_shared<std::string>();
  CLI::App& command =
      add_subcommand(app, "completion", "Print a script that completes this command in a shell",
                     "source <(millrace completion bash)");
  command.add_option("SHELL", *shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  command.callback([shell, &app, &chosen] {
    chosen.run = [shell, &app] {
      const auto wanted = base::program::parse_shell(*shell);
      fmt::print("{}", base::program::completion_script(
                           base::program::command_tree(app, "millrace"), wanted.value()));
      return base::program::exit_done;
    };
  });
}

}  // namespace millrace::tools::commands
