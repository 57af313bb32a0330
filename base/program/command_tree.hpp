// A command line for its help, its man page and its completion: the commands, and the options and
// arguments of each.
#pragma once

#include <string>
#include <utility>
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

}  // namespace millrace::base::program
