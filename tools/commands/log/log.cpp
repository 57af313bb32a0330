#include "tools/commands/log/log.hpp"

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "tools/recording/lcm_log.hpp"

namespace millrace::tools::commands::log {

namespace program = base::program;

void add_log(CLI::App& app, Chosen& chosen) {
  CLI::App& log =
      add_subcommand(app, "log", "Read recordings, whole or damaged", "millrace log info run.mcap");
  log.require_subcommand(1);
  add_info(log, chosen);
  add_ls(log, chosen);
  add_cat(log, chosen);
  add_timeline(log, chosen);
  add_export(log, chosen);
  add_repair(log, chosen);
}

void add_file(CLI::App& command, std::filesystem::path& file) {
  command.add_option("FILE", file, "A recording")->required()->check(CLI::ExistingFile);
}

mcap::FileSource open(const std::filesystem::path& file) {
  auto source = mcap::FileSource::open(file);
  if (!source) {
    throw program::UsageError(source.error());
  }
  return std::move(*source);
}

int report(const std::filesystem::path& file, const mcap::Problems& problems) {
  // Standard output first, where both go to one terminal.
  std::fflush(stdout);
  for (const mcap::Problem& problem : problems) {
    fmt::print(stderr, "{}: {}\n", file.string(), base::text::safe(problem.to_string()));
  }
  if (problems.empty()) {
    return program::exit_done;
  }
  auto source = mcap::FileSource::open(file);
  const bool is_ours = source && !recording::is_lcm_log(*source);
  fmt::print(stderr, "The rest of {} was read{}.\n", file.string(),
             is_ours ? "; 'millrace log repair' makes a complete file of it" : "");
  return program::exit_failed;
}

}  // namespace millrace::tools::commands::log
