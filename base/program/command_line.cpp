#include "base/program/command_line.hpp"

#include <cstdio>
#include <exception>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/program/supervisor.hpp"
#include "base/text/quoted.hpp"

namespace millrace::base::program {

namespace {

/// The name in messages: the file's name without its folder, as the user typed it.
std::string program_name(const char* argv0) {
  std::string_view path = argv0 != nullptr ? argv0 : "millrace";
  return std::string(path.substr(path.find_last_of('/') + 1));
}

/// What <CLI/CLI.hpp> adds to <CLI/App.hpp> is the formatter and the configuration reader, which
/// each source that includes them compiles, 3 s each time. Here is the one that does, and that uses
/// them, so that Clang keeps them too.
[[gnu::used]] std::unique_ptr<CLI::App> all_of_cli11() {
  return std::make_unique<CLI::App>();
}

}  // namespace

int run(CLI::App& app, int argc, char** argv, const std::function<int()>& body) {
  const std::string name = program_name(argc > 0 ? argv[0] : nullptr);
  app.set_version_flag("--version", fmt::format("{} {}", name, MILLRACE_VERSION));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      return app.exit(error);
    }
    fmt::print(stderr, "{}: {}\nTry '{} --help'.\n", name, text::safe(error.what(), "\n"), name);
    return exit_usage;
  }
  try {
    return body();
  } catch (const UsageError& error) {
    fmt::print(stderr, "{}: {}\n", name, text::safe(error.what(), "\n"));
    return exit_usage;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", name, text::safe(error.what(), "\n"));
    return exit_failed;
  }
}

void ready(std::string_view what) {
  fmt::print("ready: {}\n", what);
  std::fflush(stdout);
  tell_supervisor(fmt::format("READY=1\nSTATUS={}", what));
}

}  // namespace millrace::base::program
