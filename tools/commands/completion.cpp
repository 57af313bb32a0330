#include "tools/commands/completion.hpp"

#include <map>
#include <sstream>

#include <fmt/format.h>

#include "base/program/command_line.hpp"

namespace millrace::tools::commands {

namespace {

/// What may follow the words typed so far.
struct Place {
  /// "millrace log cat"
  std::string words;
  /// Subcommands, options, and words an argument may be, with their descriptions.
  std::vector<std::pair<std::string, std::string>> choices;
  /// By option, "--sync": the words its value may be; none if it may be anything.
  std::map<std::string, std::vector<std::string>> values;
};

/// The words that an option accepts, if it accepts these only: CLI11 tells them as part of its
/// type, "TEXT:{bash,zsh,fish}".
std::vector<std::string> words_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
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

/// The first line, as shells show one.
std::string first_line(const std::string& text) {
  return text.substr(0, text.find('\n'));
}

void collect(const CLI::App& app, const std::string& words, std::vector<Place>& places) {
  Place place{words, {}, {}};
  const auto subcommands = app.get_subcommands([](const CLI::App*) { return true; });
  for (const CLI::App* subcommand : subcommands) {
    place.choices.emplace_back(subcommand->get_name(), first_line(subcommand->get_description()));
  }
  for (const CLI::Option* option : app.get_options()) {
    const std::vector<std::string> accepted = words_of(*option);
    for (const std::string& name : option->get_lnames()) {
      place.choices.emplace_back("--" + name, first_line(option->get_description()));
      place.values.emplace("--" + name, accepted);
    }
    for (const std::string& name : option->get_snames()) {
      place.values.emplace("-" + name, accepted);
    }
    if (option->nonpositional()) {
      continue;
    }
    for (const std::string& word : accepted) {
      place.choices.emplace_back(word, first_line(option->get_description()));
    }
  }
  places.push_back(std::move(place));
  for (const CLI::App* subcommand : subcommands) {
    collect(*subcommand, words + " " + subcommand->get_name(), places);
  }
}

/// A bash function that looks up the subcommands typed so far; zsh runs it, too.
std::string bash_script(const std::vector<Place>& places) {
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
  // Words that are no subcommands are files and values: the shell's own completion knows files.
  return fmt::format(R"(_millrace() {{
  local word path=millrace choices= paths='{}'
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    case "$paths" in *"|$path $word|"*) path="$path $word" ;; esac
  done
  case "$path" in
{}  esac
  case "$path ${{COMP_WORDS[COMP_CWORD-1]}}" in
{}    *) ;;
  esac
  COMPREPLY=($(compgen -W "$choices" -- "${{COMP_WORDS[COMP_CWORD]}}"))
}}
complete -o default -F _millrace millrace
)",
                     paths, cases, values);
}

std::string fish_script(const std::vector<Place>& places) {
  std::string script = "complete -c millrace -n __fish_use_subcommand -f\n";
  for (const Place& place : places) {
    const auto blank = place.words.find(' ');
    std::string condition = "__fish_use_subcommand";
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
      script += fmt::format("complete -c millrace -n '{}' {} {} -d '{}'\n", condition,
                            is_option ? "-l" : "-a", is_option ? name.substr(2) : name, quoted);
    }
  }
  return script;
}

}  // namespace

std::string completion_script(const CLI::App& app, const std::string& shell) {
  std::vector<Place> places;
  collect(app, "millrace", places);
  if (shell == "fish") {
    return fish_script(places);
  }
  const std::string for_zsh = shell == "zsh" ? "autoload -U +X bashcompinit && bashcompinit\n" : "";
  return for_zsh + bash_script(places);
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
      fmt::print("{}", completion_script(app, *shell));
      return base::program::exit_done;
    };
  });
}

}  // namespace millrace::tools::commands
