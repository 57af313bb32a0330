#include "tools/commands/recordings/recordings.hpp"

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"

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

int report(const std::filesystem::path& file, const mcap::Problems& problems, bool has_read) {
  // Standard output first, where both go to one terminal.
  std::fflush(stdout);
  for (const mcap::Problem& problem : problems.described()) {
    fmt::print(stderr, "{}: {}\n", file.string(), base::text::safe(problem.to_string()));
  }
  if (problems.empty()) {
    return program::exit_done;
  }
  fmt::print(stderr, "{} {}{}.\n",
             has_read ? "Everything else has been read from" : "Nothing can be read from",
             file.string(),
             has_read ? "; 'millrace recording repair' makes a whole file of it" : "");
  return program::exit_failed;
}

}  // namespace millrace::tools::commands::recordings
