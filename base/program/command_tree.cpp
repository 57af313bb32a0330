#include "base/program/command_tree.hpp"

#include <sstream>

namespace millrace::base::program {

namespace {

/// CLI11 returns the words as part of the type: "TEXT:{bash,zsh,fish}".
std::vector<std::string> words_in(const std::string& type) {
  const auto open = type.find('{');
  const auto close = type.find('}', open);
  if (open == std::string::npos || close == std::string::npos) {
    return {};
  }
  std::vector<std::string> words;
  std::istringstream list(type.substr(open + 1, close - open - 1));
  for (std::string word; std::getline(list, word, ',');) {
    words.push_back(word);
  }
  return words;
}

CommandOption option_of(const CLI::Option& option) {
  CommandOption found;
  for (const std::string& name : option.get_snames()) {
    found.names.push_back("-" + name);
  }
  for (const std::string& name : option.get_lnames()) {
    found.names.push_back("--" + name);
  }
  const std::string type = option.get_type_name();
  if (option.get_expected_max() > 0 && option.get_type_size() != 0) {
    found.value =
        option.nonpositional() ? type.substr(0, type.find(':')) : option.get_name(true, false);
    found.words = words_in(type);
  }
  found.description = option.get_description();
  found.initial = option.get_default_str();
  found.required = option.get_required();
  found.repeated = option.get_expected_max() > 1;
  return found;
}

}  // namespace

Command command_tree(const CLI::App& app, const std::string& name) {
  Command command{name, app.get_description(), app.get_footer(), {}, {}};
  for (const CLI::Option* option : app.get_options()) {
    // An option without a group is hidden.
    if (!option->get_group().empty()) {
      command.options.push_back(option_of(*option));
    }
  }
  for (const CLI::App* each : app.get_subcommands([](const CLI::App*) { return true; })) {
    command.commands.push_back(command_tree(*each, name + " " + each->get_name()));
  }
  return command;
}

}  // namespace millrace::base::program
