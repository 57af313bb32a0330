// The manners of every millrace program: exit codes, usage errors and the ready line.
//
//   int main(int argc, char** argv) {
//     CLI::App app{"millrace-gateway: …"};
//     auto listen = …; app.add_option(…);
//     return program::run(app, argc, argv, [&] {
//       …
//       program::ready("serving cnc/1-2");
//       …
//       return 0;
//     });
//   }
//
// <CLI/App.hpp> is enough for what links millrace::manners. A program outside this tree that makes
// a CLI::App of its own includes <CLI/CLI.hpp>: the rest of CLI11 is not in libmillrace-sdk.
#pragma once

#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/App.hpp>

namespace millrace::base::program {

/// The work is done.
inline constexpr int exit_done = 0;
/// The work was understood but failed; standard error says why.
inline constexpr int exit_failed = 1;
/// An unknown flag, a wrong value, a broken configuration: nothing was started.
inline constexpr int exit_usage = 2;

/// Thrown by start-up code for what the user can put right by changing a flag or a file; ends the
/// program with exit_usage. The message says what happened, where, and what was expected.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Parses the command line, adds --version, runs `body` and turns what happens into an exit code:
/// help and version give exit_done, a wrong flag or UsageError gives exit_usage, another exception
/// exit_failed; each with one message on standard error that starts with the program's name.
int run(CLI::App& app, int argc, char** argv, const std::function<int()>& body);

/// The program can do its work no more: says why as run() does, and has it end with exit_failed,
/// whatever its body returns. By SIGTERM, so that it leaves in order; said again after 10 s, a
/// program that is still leaving leaves at once. Without a handler for that it ends here. From any
/// thread.
void give_up(const std::string& why);

/// Adds an option that takes one of these words, and whose help names them.
template <typename Value>
CLI::Option* add_choice(CLI::App& app, const std::string& name, Value& value,
                        const std::map<std::string, Value>& choices,
                        const std::string& description) {
  std::vector<std::string> words;
  words.reserve(choices.size());
  for (const auto& [word, meaning] : choices) {
    words.push_back(word);
  }
  return app
      .add_option_function<std::string>(
          name, [&value, choices](const std::string& word) { value = choices.at(word); },
          description)
      ->check(CLI::IsMember(words))
      ->type_name("WORD");
}

/// Whether --check is on the command line: read the configuration, say what is wrong with it, and
/// serve nothing.
bool asks_for_check(int argc, char** argv);

/// run() for such a command line, which has --config FILE beside: prints "FILE is good: WHAT".
/// `what` reads the file and throws UsageError with its mistakes.
int check(int argc, char** argv, const std::function<std::string(const std::string& file)>& what);

/// Adds --check to the help of a program that looks for it with asks_for_check().
void add_check(CLI::App& app);

/// Writes "ready: WHAT" to standard output and flushes it, and tells the supervisor. Called once,
/// when the program serves.
void ready(std::string_view what);

}  // namespace millrace::base::program
