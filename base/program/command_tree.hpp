// A command line for its help, its man page and its completion: the commands, and the options and
// arguments of each.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/App.hpp>

namespace millrace::base::program {

/// A flag, an option or an argument.
struct CommandOption {
  /// "-o", "--output"; empty for an argument.
  std::vector<std::string> names;
  /// Name of the value: "FILE", "WORD"; empty for a flag.
  std::string value;
  /// The valid words of the value; empty = any value.
  std::vector<std::string> words;
  std::string description;
  /// The default as shown; empty if there is none.
  std::string initial;
  bool required = false;
  bool repeated = false;
};

struct Command {
  /// For example "millrace recording cat".
  std::string words;
  std::string description;
  /// Usually examples.
  std::string footer;
  std::vector<CommandOption> options;
  std::vector<Command> commands;
};

/// All parts of `app` that are not hidden; `name` is the program's name.
Command command_tree(const CLI::App& app, const std::string& name);

// The man page of a program, generated from the same data as its --help.
//
//   fmt::print("{}", man_page(command_tree(app, "millrace-gateway"), "1.0.0"));

/// In roff with the macros of man(7), section 1.
std::string man_page(const Command& command, const std::string& version);

// Scripts that complete a command in a shell.
//
//   fmt::print("{}", completion_script(command_tree(app, "millrace"), Shell::bash));

enum class Shell : std::uint8_t { bash, zsh, fish };

/// "bash", "zsh" or "fish".
std::optional<Shell> parse_shell(std::string_view word);

/// Offers subcommands, options, and the valid words of arguments and of options' values. The shell
/// completes all other words, such as file names.
std::string completion_script(const Command& command, Shell shell);

}  // namespace millrace::base::program
