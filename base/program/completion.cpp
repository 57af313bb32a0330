#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "base/program/command_tree.hpp"

namespace millrace::base::program {

namespace {

/// The possible continuations of the words typed so far.
struct Place {
  /// For example "millrace recording cat".
  std::string words;
  /// Subcommands, options, and the valid words of arguments, with their descriptions.
  std::vector<std::pair<std::string, std::string>> choices;
  /// By option, such as "--sync": the valid words of its value; empty = any value.
  std::map<std::string, std::vector<std::string>> values;
};

/// The first line, which shells show.
std::string first_line(const std::string& text) {
  return text.substr(0, text.find('\n'));
}

void collect(const Command& command, std::vector<Place>& places) {
  Place place{command.words, {}, {}};
  for (const Command& subcommand : command.commands) {
    place.choices.emplace_back(subcommand.words.substr(command.words.size() + 1),
                               first_line(subcommand.description));
  }
  for (const CommandOption& option : command.options) {
    for (const std::string& name : option.names) {
      if (name.starts_with("--")) {
        place.choices.emplace_back(name, first_line(option.description));
      }
      place.values.emplace(name, option.words);
    }
    if (option.names.empty()) {
      for (const std::string& word : option.words) {
        place.choices.emplace_back(word, first_line(option.description));
      }
    }
  }
  places.push_back(std::move(place));
  for (const Command& subcommand : command.commands) {
    collect(subcommand, places);
  }
}

/// For example "_millrace_gateway".
std::string function_of(std::string program) {
  std::replace(program.begin(), program.end(), '-', '_');
  return "_" + program;
}

/// A bash function that finds the subcommands typed so far; zsh runs it, too.
std::string bash_script(const std::vector<Place>& places) {
  const std::string& program = places.front().words;
  std::string paths = "|";
  std::string cases;
  std::string values;
  for (const Place& place : places) {
    std::string names;
    for (const auto& [name, description] : place.choices) {
      names += " " + name;
    }
    paths += place.words + "|";
    cases += fmt::format("    '{}') choices='{}' ;;\n", place.words, names.substr(1));
    for (const auto& [option, accepted] : place.values) {
      if (!accepted.empty()) {
        values += fmt::format("    '{} {}') choices='{}' ;;\n", place.words, option,
                              fmt::join(accepted, " "));
      }
    }
  }
  // Words other than subcommands are files and values: the shell completes file names itself.
  return fmt::format(R"({0}() {{
  local word path={1} choices= paths='{2}'
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    case "$paths" in *"|$path $word|"*) path="$path $word" ;; esac
  done
  case "$path" in
{3}  esac
  case "$path ${{COMP_WORDS[COMP_CWORD-1]}}" in
{4}    *) ;;
  esac
  COMPREPLY=($(compgen -W "$choices" -- "${{COMP_WORDS[COMP_CWORD]}}"))
}}
complete -o default -F {0} {1}
)",
                     function_of(program), program, paths, cases, values);
}

std::string fish_script(const std::vector<Place>& places) {
  const std::string& program = places.front().words;
  std::string script;
  if (places.size() > 1) {
    script = fmt::format("complete -c {} -n __fish_use_subcommand -f\n", program);
  }
  for (const Place& place : places) {
    const auto blank = place.words.find(' ');
    std::string condition = places.size() > 1 ? "__fish_use_subcommand" : "true";
    if (blank != std::string::npos) {
      // Every word of the path must have been typed.
      condition.clear();
      std::string rest = place.words.substr(blank + 1);
      for (std::size_t end = 0; !rest.empty();
           rest.erase(0, end == std::string::npos ? end : end + 1)) {
        end = rest.find(' ');
        condition += (condition.empty() ? "" : "; and ") +
                     fmt::format("__fish_seen_subcommand_from {}", rest.substr(0, end));
      }
    }
    for (const auto& [name, description] : place.choices) {
      const bool is_option = name.starts_with("--");
      std::string quoted = description;
      std::erase(quoted, '\'');
      script += fmt::format("complete -c {} -n '{}' {} {} -d '{}'\n", program, condition,
                            is_option ? "-l" : "-a", is_option ? name.substr(2) : name, quoted);
    }
  }
  return script;
}

}  // namespace

std::optional<Shell> parse_shell(std::string_view word) {
  if (word == "bash") {
    return Shell::bash;
  }
  if (word == "zsh") {
    return Shell::zsh;
  }
  return word == "fish" ? std::optional(Shell::fish) : std::nullopt;
}

std::string completion_script(const Command& command, Shell shell) {
  std::vector<Place> places;
  collect(command, places);
  switch (shell) {
    case Shell::fish:
      return fish_script(places);
    case Shell::zsh:
      return "autoload -U +X bashcompinit && bashcompinit\n" + bash_script(places);
    case Shell::bash:
      break;
  }
  return bash_script(places);
}

}  // namespace millrace::base::program
