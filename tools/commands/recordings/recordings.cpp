#include "tools/commands/recordings/recordings.hpp"

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::commands::recordings {

namespace program = base::program;

void add_recording(CLI::App& app, Chosen& chosen) {
  CLI::App& recording = add_subcommand(app, "recording", "Read recordings, whole or damaged",
                                       "millrace recording info run.mcap");
  recording.require_subcommand(1);
  add_info(recording, chosen);
  add_cat(recording, chosen);
  add_calls(recording, chosen);
  add_export(recording, chosen);
  add_repair(recording, chosen);
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
  fmt::print(stderr, "Everything else in {} has been read{}.\n", file.string(),
             is_ours ? "; 'millrace recording repair' makes a whole file of it" : "");
  return program::exit_failed;
}

}  // namespace millrace::tools::commands::recordings
