// A command line as its help, its man page and its completion tell it: the commands, and what may
// follow each.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <CLI/App.hpp>

namespace millrace::base::program {

/// A flag, an option or an argument.
struct CommandOption {
  /// "-o", "--output"; none of an argument.
  std::vector<std::string> names;
  /// What the value is called: "FILE", "WORD"; empty for a flag.
  std::string value;
  /// The words that the value may be; none if it may be anything.
  std::vector<std::string> words;
  std::string description;
  /// Shown as it is; empty if there is none.
  std::string initial;
  bool required = false;
  bool repeated = false;
};

struct Command {
  /// "millrace log cat"
  std::string words;
  std::string description;
  /// Examples, mostly.
  std::string footer;
  std::vector<CommandOption> options;
  std::vector<Command> commands;
};

/// Everything of `app` but what is hidden, whose program is called `name`.
Command command_tree(const CLI::App& app, const std::string& name);

}  // namespace millrace::base::program
