#include "base/program/command_line.hpp"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include "base/program/command_tree.hpp"
#include "base/program/supervisor.hpp"
#include "base/program/version.hpp"
#include "base/text/ascii.hpp"
#include "base/text/quoted.hpp"

namespace millrace::base::program {

namespace {

/// The process's name in messages: the file's name without its folder, as the user typed it.
std::string program_name(const char* argv0) {
  std::string_view path = argv0 != nullptr ? argv0 : "millrace";
  return std::string(path.substr(path.find_last_of('/') + 1));
}

/// Prints why the process ends.
void tell(const std::string& name, std::string_view why) {
  fmt::print(stderr, "{}{}: {}\n", is_journal(STDERR_FILENO) ? "<3>" : "", name,
             text::safe(why, "\n"));
}

/// The files for a package: the man page for --man-page, a script for --completion SHELL. Empty
/// without these flags. Handled before the line is parsed, which may require other words.
std::string page_of(const CLI::App& app, const std::string& name, int argc, char** argv) {
  const std::vector<std::string_view> words(argv, argv + argc);
  // Commands that a process removes from the line before have their own name.
  const auto tree = [&] {
    return command_tree(app, app.get_name().empty() ? name : app.get_name());
  };
  if (words.size() == 2 && words[1] == "--man-page") {
    return man_page(tree(), version());
  }
  if (words.size() == 3 && words[1] == "--completion") {
    const auto shell = parse_shell(words[2]);
    return shell ? completion_script(tree(), *shell) : "";
  }
  return "";
}

/// The requested command, as far as it is known.
struct Asked {
  const CLI::App& command;
  /// For example "millrace trust".
  std::string words;
};

Asked asked_of(const CLI::App& app, const std::string& name) {
  const CLI::App* command = &app;
  std::string words = name;
  for (auto next = command->get_subcommands(); !next.empty(); next = command->get_subcommands()) {
    command = next.front();
    words += " " + command->get_name();
  }
  return {*command, std::move(words)};
}

using Words = std::vector<std::string>;

/// " (did you mean 'services'?)" where a known word is near; "" where none is.
std::string meant(const std::string& word, const Words& known) {
  const auto distance = [&](const std::string& name) { return text::edit_distance(word, name); };
  const auto nearest = std::ranges::min_element(known, {}, distance);
  // A third of the word may be wrong, as in "servces" and "chanels".
  return nearest == known.end() || distance(*nearest) > std::max<std::size_t>(1, word.size() / 3)
             ? ""
             : fmt::format(" (did you mean '{}'?)", *nearest);
}

/// Describes the error in the order of the user's words, and with the word at the place of a
/// missing one: CLI11 reports neither.
std::string wrong_with(const Asked& asked, const CLI::ParseError& error) {
  const auto code = static_cast<CLI::ExitCodes>(error.get_exit_code());
  const std::vector<std::string> unknown = asked.command.remaining();
  if (unknown.empty() ||
      (code != CLI::ExitCodes::RequiredError && code != CLI::ExitCodes::ExtrasError)) {
    return error.what();
  }
  Words options;
  for (const CommandOption& option : command_tree(asked.command, "").options) {
    options.insert(options.end(), option.names.begin(), option.names.end());
  }
  const std::string unexpected = fmt::format("unexpected argument: {}{}", fmt::join(unknown, " "),
                                             meant(unknown.front(), options));
  return code == CLI::ExitCodes::ExtrasError ? unexpected
                                             : fmt::format("{}; {}", error.what(), unexpected);
}

/// The commands, for the message about a missing one.
std::string commands_for(const Asked& asked) {
  Words commands;
  for (const Command& command : command_tree(asked.command, "").commands) {
    commands.push_back(command.words.substr(1));
  }
  const Words unknown = asked.command.remaining();
  return fmt::format("{}; expected one of: {}",
                     unknown.empty() ? "a command is missing"
                                     : fmt::format("unknown command '{}'{}", unknown.front(),
                                                   meant(unknown.front(), commands)),
                     fmt::join(commands, ", "));
}

/// The examples stand before the options.
class ExamplesFirst : public CLI::Formatter {
 public:
  std::string make_description(const CLI::App* app) const override {
    const std::string footer = app->get_footer();
    return CLI::Formatter::make_description(app) + (footer.empty() ? "" : footer + "\n\n");
  }
  std::string make_footer(const CLI::App* /*app*/) const override { return ""; }
};

void set_formatter(CLI::App& app, const std::shared_ptr<CLI::FormatterBase>& formatter) {
  app.formatter(formatter);
  for (CLI::App* const command : app.get_subcommands({})) {
    set_formatter(*command, formatter);
  }
}

/// CLI11 takes -1 for 18446744073709551615 where a flag has an unsigned number.
void refuse_negative(CLI::App& app) {
  for (CLI::Option* const option : app.get_options()) {
    if (option->get_type_name() == "UINT" || option->get_type_name() == "N") {
      option->check([](const std::string& text) {
        return text.find('-') == std::string::npos
                   ? std::string()
                   : fmt::format("{} is not allowed; expected 0 or a greater number", text);
      });
    }
  }
  for (CLI::App* const command : app.get_subcommands({})) {
    refuse_negative(*command);
  }
}

/// <CLI/CLI.hpp> adds the formatter and the configuration reader to <CLI/App.hpp>; each source that
/// includes them compiles them, 3 s each time. Only this source includes them, and it uses them, so
/// that Clang keeps them too.
[[gnu::used]] std::unique_ptr<CLI::App> all_of_cli11() {
  return std::make_unique<CLI::App>();
}

}  // namespace

namespace {

/// A process has one name and one end.
std::string& own_name() {
  static std::string name = "millrace";
  return name;
}
std::atomic<bool> given_up = false;

}  // namespace

void give_up(const std::string& why) {
  using Clock = std::chrono::steady_clock;
  // Several parts of a process may report the same failure.
  constexpr std::chrono::seconds once{10};
  static std::mutex lock;
  static std::optional<Clock::time_point> last;
  {
    const std::lock_guard guard(lock);
    if (last && Clock::now() - *last < once) {
      return;
    }
    last = Clock::now();
  }
  if (!given_up.exchange(true)) {
    tell(own_name(), why);
  }
  struct sigaction terminate {};
  if (::sigaction(SIGTERM, nullptr, &terminate) != 0 || terminate.sa_handler == SIG_DFL) {
    std::fflush(nullptr);
    std::_Exit(exit_failed);
  }
  ::kill(::getpid(), SIGTERM);
}

int run(CLI::App& app, int argc, char** argv, const std::function<int()>& body) {
  const std::string name = program_name(argc > 0 ? argv[0] : nullptr);
  own_name() = name;
  set_formatter(app, std::make_shared<ExamplesFirst>());
  refuse_negative(app);
  if (app.get_version_ptr() == nullptr) {
    app.set_version_flag("--version", fmt::format("{} {}", name, version_and_commit()),
                         "Print the version and exit");
  }
  if (const std::string page = page_of(app, name, argc, argv); !page.empty()) {
    fmt::print("{}", page);
    return exit_done;
  }
  if (app.get_name().empty()) {
    app.name(name);  // CLI11 takes the path of the file otherwise.
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      return app.exit(error);
    }
    const Asked asked = asked_of(app, name);
    const bool no_command =
        std::string_view(error.what()) == CLI::RequiredError::Subcommand(1).what();
    tell(name, no_command ? commands_for(asked) : wrong_with(asked, error));
    fmt::print(stderr, "Try '{} --help'.\n", asked.words);
    return exit_usage;
  }
  try {
    const int code = body();
    return given_up ? exit_failed : code;
  } catch (const UsageError& error) {
    tell(name, error.what());
    return exit_usage;
  } catch (const std::exception& error) {
    tell(name, error.what());
    return exit_failed;
  }
}

namespace {

constexpr std::string_view check_flag = "--check";

/// The file is optional: without it that of --config is checked.
void add_check(CLI::App& app, std::string& file) {
  app.add_option(std::string(check_flag), file,
                 "Read this configuration (default: that of --config), print its mistakes and exit")
      ->type_name("FILE")
      ->expected(0, 1);
}

}  // namespace

bool asks_for_check(int argc, char** argv) {
  return std::any_of(argv, argv + argc, [](std::string_view argument) {
    return argument == check_flag || argument.starts_with("--check=");
  });
}

int check(int argc, char** argv, const std::function<std::string(const std::string&)>& what) {
  CLI::App app{"Checks a configuration"};
  std::string file;
  std::string named;
  app.add_option("--config", file, "The configuration")->type_name("FILE");
  add_check(app, named);
  return run(app, argc, argv, [&] {
    file = named.empty() ? file : named;
    if (file.empty()) {
      throw UsageError("--check: expected a configuration, as in --check FILE");
    }
    fmt::print("{} is good: {}\n", file, what(file));
    return exit_done;
  });
}

void add_check(CLI::App& app) {
  static std::string unused;
  add_check(app, unused);
}

void ready(std::string_view what) {
  fmt::print("ready: {}\n", what);
  std::fflush(stdout);
  notify_supervisor(fmt::format("READY=1\nSTATUS={}", what));
}

namespace {

/// False for a text that is not a finite number.
bool is_number(const std::string& text, double& number) {
  const char* const end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && at == end && std::isfinite(number);
}

CLI::Validator checked(std::string name, std::string expected, bool (*fits)(double)) {
  return {[expected = std::move(expected), fits](const std::string& text) {
            double number = 0;
            return is_number(text, number) && fits(number)
                       ? std::string()
                       : fmt::format("{} is not allowed; expected {}", text, expected);
          },
          std::move(name)};
}

}  // namespace

CLI::Validator positive_number() {
  return checked("POSITIVE", "a number greater than 0", [](double number) { return number > 0; });
}

CLI::Validator non_negative_number() {
  return checked("NONNEGATIVE", "0 or a greater number", [](double number) { return number >= 0; });
}

}  // namespace millrace::base::program
