// Help and completion of every subcommand of the operator's command.

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/terminal.hpp"

namespace millrace::tests::integration {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsSupersetOf;
using testing::Not;

using Words = std::vector<std::string>;

std::string output_of(const Words& command) {
  Process process(command);
  EXPECT_EQ(process.wait(), 0) << process.error_output();
  return process.output();
}

std::string joined(const Words& words) {
  std::string text;
  for (const std::string& word : words) {
    text += (text.empty() ? "" : " ") + word;
  }
  return text;
}

struct Help {
  std::string text;
  Words subcommands;
  Words options;
};

Help help_of(Words path) {
  if (path.size() > 1 && path.front() == "vars") {
    path.insert(path.begin() + 1, "cnc");  // MACHINE stands before the subcommand.
  }
  path.insert(path.begin(), binary("millrace"));
  path.emplace_back("--help");
  Help help{output_of(path), {}, {}};
  std::istringstream lines(help.text);
  bool in_subcommands = false;
  std::smatch found;
  for (std::string line; std::getline(lines, line);) {
    if (std::regex_match(line, std::regex("(Subcommands|Look|Act|Check|Record|Set up):"))) {
      in_subcommands = true;
    } else if (line.empty()) {
      in_subcommands = false;
    } else if (in_subcommands && std::regex_search(line, found, std::regex("^  ([a-z-]+)"))) {
      help.subcommands.push_back(found[1]);
    } else if (std::regex_search(line, found, std::regex("^  (?:-[a-zA-Z],)?(--[a-z0-9-]+)"))) {
      help.options.push_back(found[1]);
    }
  }
  return help;
}

/// The help of the command itself and of all its subcommands, by their words.
const std::map<std::string, Help>& all_help() {
  static const std::map<std::string, Help> all = [] {
    std::map<std::string, Help> found;
    std::vector<Words> open{{}};
    while (!open.empty()) {
      const Words path = open.back();
      open.pop_back();
      const Help& help = found[joined(path)] = help_of(path);
      for (const std::string& subcommand : help.subcommands) {
        open.push_back(path);
        open.back().push_back(subcommand);
      }
    }
    return found;
  }();
  return all;
}

/// The programs of the packages.
const Words programs{"millrace",       "millrace-gateway",    "millrace-cnc",  "millrace-archiver",
                     "millrace-batch", "millrace-dial-gauge", "millrace-http", "millrace-lcm",
                     "millrace-mail",  "millrace-square-root"};

/// The completion script in the program's package.
std::string completion_of(const std::string& program) {
  return program == "millrace" ? "completion bash" : "--completion bash";
}

/// What bash offers for an unfinished line, once it has loaded the completion.
Words offered(const std::string& line) {
  std::istringstream words_in(line + "|");
  Words words;
  for (std::string word; words_in >> word;) {
    words.push_back(word);
  }
  words.back().pop_back();
  std::string array;
  for (const std::string& word : words) {
    array += "'" + word + "' ";
  }
  const std::string& program = words.front();
  const std::string script = "source <('" + binary(program) + "' " + completion_of(program) +
                             "); COMP_WORDS=(" + array +
                             "); COMP_CWORD=" + std::to_string(words.size() - 1) +
                             "; _${COMP_WORDS[0]//-/_}; printf '%s\\n' \"${COMPREPLY[@]}\"";
  std::istringstream lines(output_of({"/bin/bash", "--norc", "--noprofile", "-c", script}));
  Words found;
  for (std::string word; std::getline(lines, word);) {
    found.push_back(word);
  }
  return found;
}

/// The options that a help names.
Words options_in(const std::string& help) {
  Words options;
  std::istringstream lines(help);
  std::smatch found;
  for (std::string line; std::getline(lines, line);) {
    if (std::regex_search(line, found, std::regex("^  (?:-[a-zA-Z],)?(--[a-z0-9-]+)"))) {
      options.push_back(found[1]);
    }
  }
  return options;
}

/// The error message of an invalid command line, which has no other effect.
std::string error_of(Words command) {
  command.front() = binary(command.front());
  Process process(command);
  EXPECT_EQ(process.wait(), 2);
  EXPECT_EQ(process.output(), "");
  return process.error_output();
}

TEST(AMistake, NamesAnUnknownCommand) {
  EXPECT_EQ(
      error_of({"millrace", "recording", "ct", "run.mcap"}),
      "millrace: unknown command 'ct' (did you mean 'cat'?); expected one of: info, cat, calls, "
      "export, repair\n"
      "Try 'millrace recording --help'.\n");
  EXPECT_THAT(error_of({"millrace", "servces"}),
              HasSubstr("unknown command 'servces' (did you mean 'services'?); expected one of: "
                        "status, machines, "));
  EXPECT_THAT(error_of({"millrace", "everything"}), Not(HasSubstr("did you mean")));
}

TEST(AMistake, NamesAMissingCommand) {
  EXPECT_THAT(error_of({"millrace", "vars", "cnc"}),
              HasSubstr("a command is missing; expected one of: list, read, write\n"
                        "Try 'millrace vars --help'.\n"));
}

TEST(AMistake, NamesAnUnknownArgumentAsItWasTyped) {
  EXPECT_EQ(error_of({"millrace", "services", "--uid", "x"}),
            "millrace: unexpected argument: --uid\nTry 'millrace services --help'.\n");
  EXPECT_EQ(error_of({"millrace-square-root", "--uid", "x"}),
            "millrace-square-root: unexpected argument: --uid x (did you mean '--uuid'?)\nTry "
            "'millrace-square-root --help'.\n");
}

TEST(AMistake, NamesUnknownArgumentsBesideMissingOnes) {
  EXPECT_EQ(
      error_of({"millrace", "call", "--txt"}),
      "millrace: SERVICE is required; unexpected argument: --txt\nTry 'millrace call --help'.\n");
}

TEST(TheHelp, OfEverySubcommandShowsAnExample) {
  ASSERT_GT(all_help().size(), 20U);
  for (const auto& [words, help] : all_help()) {
    if (!words.empty()) {
      EXPECT_THAT(help.text, HasSubstr("Example:\n")) << words;
      EXPECT_THAT(help.text, HasSubstr("millrace " + words.substr(0, words.find(' ')))) << words;
    }
  }
}

TEST(TheHelp, HasTheCommandsInGroupsAndTheExamplesFirst) {
  const std::string help = all_help().at("").text;
  EXPECT_THAT(help,
              testing::ContainsRegex("Examples:\n(.|\n)*\nUsage: millrace \\[OPTIONS\\](.|\n)*"
                                     "\nLook:\n  status (.|\n)*\nAct:\n(.|\n)*\nCheck:\n(.|\n)*"
                                     "\nRecord:\n(.|\n)*\nSet up:\n"));
  EXPECT_THAT(
      all_help().at("services").text,
      testing::ContainsRegex("Example(.|\n)*\nUsage: millrace services \\[OPTIONS\\](.|\n)*"
                             "\nOptions:\n(.|\n)*  --json(.|\n)*\nFabric:\n(.|\n)*  --domain"));
}

TEST(TheHelp, OfEverySubcommandThatPrintsHasJson) {
  // A script for a shell; an export with another choice of format; commands over HTTP; commands
  // that write files and print their paths.
  const std::set<std::string> without_json{
      "completion",  "controller add-route", "recording export",
      "web",         "trust export",         "trust init",
      "trust issue", "trust renew",          "trust renew-authorities",
      "trust revoke"};
  for (const auto& [words, help] : all_help()) {
    if (help.subcommands.empty() && !without_json.contains(words)) {
      EXPECT_THAT(help.options, Contains("--json")) << words;
    }
  }
}

TEST(TheCompletion, OffersEverySubcommandAndOptionInBash) {
  for (const auto& [words, help] : all_help()) {
    const Words found = offered("millrace " + words + (words.empty() ? "" : " "));
    EXPECT_THAT(found, IsSupersetOf(help.subcommands)) << words;
    EXPECT_THAT(found, IsSupersetOf(help.options)) << words;
  }
}

TEST(TheCompletion, OffersTheValuesOfAnArgument) {
  EXPECT_THAT(offered("millrace completion "), IsSupersetOf({"bash", "fish", "zsh"}));
  EXPECT_THAT(offered("millrace record --sync "),
              testing::UnorderedElementsAre("none", "interval", "call"));
  EXPECT_THAT(offered("millrace vars cnc list --family V."), IsSupersetOf({"V.E", "V.G"}));
  EXPECT_THAT(offered("millrace recording cat --kind re"),
              testing::UnorderedElementsAre("request", "reply"));
}

TEST(TheCompletion, OffersTheOptionsOfEveryProgram) {
  for (const std::string& program : programs) {
    const Words options = options_in(output_of({binary(program), "--help"}));
    EXPECT_THAT(options, Contains("--version")) << program;
    EXPECT_THAT(offered(program + " --"), IsSupersetOf(options)) << program;
  }
  EXPECT_THAT(offered("millrace-gateway --log-level w"), testing::ElementsAre("warn"));
  EXPECT_THAT(offered("millrace-mail --delivery "),
              testing::UnorderedElementsAre("at-least-once", "at-most-once"));
}

/// The man page of a program as `man` shows it, without warnings.
std::string shown_by_man(const Words& program) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "page.1";
  Words command = program;
  command.front() = binary(command.front());
  command.emplace_back("--man-page");
  std::ofstream(file) << output_of(command);
  Process man(
      {"/usr/bin/env", "MANWIDTH=100", "LC_ALL=C.UTF-8", "man", "--warnings", "-l", file.string()});
  EXPECT_EQ(man.wait(), 0) << man.error_output();
  EXPECT_EQ(man.error_output(), "") << joined(program);
  return man.output();
}

TEST(TheManPage, OfEveryProgramHasItsOptions) {
  if (!std::filesystem::exists("/usr/bin/man")) {
    GTEST_SKIP() << "man is not installed (deploy/install-deps)";
  }
  for (const std::string& program : programs) {
    const std::string page = shown_by_man({program});
    EXPECT_THAT(page, testing::ContainsRegex("NAME\n +" + program + " - .")) << page;
    EXPECT_THAT(page, HasSubstr("EXIT STATUS"));
    for (const std::string& option : options_in(output_of({binary(program), "--help"}))) {
      EXPECT_THAT(page, HasSubstr(option)) << program;
    }
  }
  EXPECT_THAT(shown_by_man({"millrace-archiver", "query"}),
              testing::ContainsRegex("NAME\n +millrace-archiver query - .*(.|\n)*--count"));
}

TEST(TheManPage, HasEverySubcommandWithItsOptions) {
  if (!std::filesystem::exists("/usr/bin/man")) {
    GTEST_SKIP() << "man is not installed (deploy/install-deps)";
  }
  const std::string page = shown_by_man({"millrace"});
  for (const auto& [words, help] : all_help()) {
    EXPECT_THAT(page, HasSubstr(words.empty() ? "millrace" : "millrace " + words));
    for (const std::string& option : help.options) {
      EXPECT_THAT(page, HasSubstr(option)) << words;
    }
  }
}

TEST(TheCompletion, CompletesWhatIsTypedIntoARealBash) {
  if (const std::string reason = Terminal::obstacle(); !reason.empty()) {
    GTEST_SKIP() << reason;
  }
  Terminal sut({"/bin/bash", "--norc", "--noprofile", "-i"}, {.rows = 24, .columns = 200});
  sut.type("PS1='> '; source <('" + binary("millrace") + "' completion bash); echo rea''dy\n");
  sut.await("ready\r\n");
  sut.type("millrace ser\t");
  sut.await("millrace services ");
  sut.type("--js\t");
  sut.await("millrace services --json ");
  sut.type("\x15");  // Takes the line away.
  sut.type("exit\n");
  EXPECT_EQ(sut.wait(), 0) << sut.output();
}

}  // namespace
}  // namespace millrace::tests::integration
