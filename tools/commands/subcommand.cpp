#include "tools/commands/subcommand.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/program/command_tree.hpp"
#include "base/program/version.hpp"

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

namespace {

template <std::size_t count>
bool is_among(const std::array<std::string_view, count>& words, const std::string& word) {
  return std::ranges::find(words, word.substr(0, word.find('='))) != words.end();
}

constexpr std::array<std::string_view, 3> with_value{"--fabric-config", "--domain", "--fabric"};
constexpr std::array<std::string_view, 3> flags{"--json", "--csv", "--wide"};
/// After MACHINE in `vars MACHINE list`.
constexpr std::array<std::string_view, 3> of_vars{"list", "read", "write"};
/// About the program itself.
constexpr std::array<std::string_view, 5> own{"--help", "-h", "--version", "--man-page",
                                              "--completion"};

}  // namespace

std::vector<std::string> word_order(std::vector<std::string> words) {
  if (!words.empty() && words.front() == "help") {
    std::rotate(words.begin(), words.begin() + 1, words.end());
    words.back() = "--help";
    return words;
  }
  if (words.size() == 1 && words.front() == "version") {
    return {"--version"};
  }
  auto command = words.begin();
  while (command != words.end() && (is_among(with_value, *command) || is_among(flags, *command))) {
    const bool has_value =
        is_among(with_value, *command) && command->find('=') == std::string::npos;
    command += has_value ? std::min<std::ptrdiff_t>(2, words.end() - command) : 1;
  }
  std::vector<std::string> global(words.begin(), command);
  words.erase(words.begin(), command);
  if (words.empty() || (words.front().starts_with('-') && !is_among(own, words.front()))) {
    words.insert(words.begin(), "status");
  }
  if (words.size() > 2 && words[0] == "vars" && is_among(of_vars, words[1]) &&
      !is_among(of_vars, words[2]) && !words[2].starts_with('-')) {
    std::swap(words[1], words[2]);
  }
  // What follows "--" is no option.
  words.insert(std::ranges::find(words, "--"), global.begin(), global.end());
  return words;
}

std::string library_name() {
  return fmt::format("millrace {}", base::program::version());
}

void warn_of_the_one_connection(const gateway::settings::MachineSettings& machine) {
  if (machine.controller.host.starts_with("127.") || machine.controller.host == "localhost") {
    return;
  }
  fmt::print(stderr,
             "millrace: a TwinCAT router keeps one connection per host, the newest: a gateway on "
             "this host loses its connection to {} now and restores it as soon as it can\n",
             machine.name);
}

}  // namespace millrace::tools::commands
