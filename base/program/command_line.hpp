// The start-up conventions of every millrace process: exit codes, usage errors and the ready line.
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
// <CLI/App.hpp> is enough for targets that link millrace::manners. A program outside this tree with
// its own CLI::App includes <CLI/CLI.hpp>: the rest of CLI11 is not in libmillrace-sdk.
#pragma once

#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/App.hpp>

namespace millrace::base::program {

/// The work is done.
inline constexpr int exit_done = 0;
/// The work failed; standard error has the reason.
inline constexpr int exit_failed = 1;
/// An unknown flag, a wrong value, an invalid configuration: nothing was started.
inline constexpr int exit_usage = 2;

/// Thrown by start-up code for errors that the user can correct by changing a flag or a file; ends
/// the process with exit_usage. The message contains what happened, where, and what was expected.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The value of a tl::expected; throws UsageError with its error.
template <typename Result>
typename Result::value_type must(Result result) {
  if (!result) {
    throw UsageError(result.error());
  }
  return *std::move(result);
}

/// Parses the command line, adds --version, runs `body` and returns the exit code. Help and version
/// return exit_done, a wrong flag or UsageError returns exit_usage, any other exception
/// exit_failed. Each error prints one message on standard error that starts with the process's
/// name.
int run(CLI::App& app, int argc, char** argv, const std::function<int()>& body);

/// The process cannot continue: prints the reason as run() does, and makes it end with exit_failed,
/// whatever its body returns. Sends SIGTERM to the process itself, so that it shuts down in order.
/// A call more than 10 s later sends SIGTERM again, which ends a process that is still shutting
/// down. Without a SIGTERM handler the process ends at once. From any thread.
void give_up(const std::string& why);

/// Adds an option that accepts one of these words; its help lists them.
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

/// True if --check is on the command line: read the configuration, report its mistakes, and serve
/// nothing.
bool asks_for_check(int argc, char** argv);

/// run() for such a command line, which also has --config FILE: prints "FILE is good: WHAT". `what`
/// reads the file and throws UsageError with its mistakes.
int check(int argc, char** argv, const std::function<std::string(const std::string& file)>& what);

/// Adds --check to the help of a program that tests for it with asks_for_check().
void add_check(CLI::App& app);

/// Writes "ready: WHAT" to standard output, flushes it, and notifies the supervisor. Call it once,
/// when the process serves.
void ready(std::string_view what);

// Validators of numeric options with readable messages: CLI11's own validators print the greatest
// double with all of its 309 digits.
//
//   app.add_option("--rate", rate)->check(base::program::positive_number());

/// Greater than 0.
CLI::Validator positive_number();
/// 0 or greater.
CLI::Validator non_negative_number();

}  // namespace millrace::base::program
