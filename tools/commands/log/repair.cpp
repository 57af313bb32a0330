// millrace log repair: a whole file out of one that was cut or damaged.
#include <fmt/format.h>

#include "idl/program/command_line.hpp"
#include "tools/commands/log/log.hpp"
#include "tools/commands/version.hpp"
#include "tools/mcap/repair_file.hpp"

namespace millrace::tools::commands::log {

namespace {

struct Options {
  std::filesystem::path file;
  std::filesystem::path output;
};

int repair(const Options& options) {
  const std::filesystem::path output =
      options.output.empty() ? mcap::repaired_name(options.file) : options.output;
  const auto done = mcap::repair_file(options.file, output, library_name());
  if (!done) {
    throw std::runtime_error(done.error());
  }
  for (const mcap::Problem& problem : done->problems) {
    fmt::print("{}: {}\n", options.file.string(), problem.to_string());
  }
  fmt::print("{}: {} messages in {} chunks\n", output.string(), done->saved.messages,
             done->saved.chunks);
  return idl::program::exit_done;
}

}  // namespace

void add_repair(CLI::App& log, Chosen& chosen) {
  auto options = std::make_shared<Options>();
  CLI::App& command = add_subcommand(
      log, "repair", "Write what can be read of a cut or damaged recording to a new, whole file",
      "millrace log repair run.mcap.part -o run.mcap");
  add_file(command, options->file);
  command.add_option("-o,--output", options->output,
                     "The new file; by default FILE with .repaired before .mcap");
  command.callback([options, &chosen] { chosen.run = [options] { return repair(*options); }; });
}

}  // namespace millrace::tools::commands::log
