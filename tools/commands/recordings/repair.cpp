// millrace recording repair: a whole file out of one that was cut or damaged.
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "tools/commands/recordings/recordings.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/print/json.hpp"
#include "tools/recorder/recording_file.hpp"

namespace millrace::tools::commands::recordings {

namespace {

struct RepairOptions {
  std::filesystem::path file;
  std::filesystem::path output;
  bool json = false;
};

void show(const RepairOptions& options, const std::filesystem::path& output,
          const mcap::RepairReport& report) {
  if (options.json) {
    boost::json::array problems;
    for (const mcap::Problem& problem : report.problems.described()) {
      problems.emplace_back(print::utf8(problem.to_string()));
    }
    print::print_json(boost::json::object{{"file", print::utf8(output.string())},
                                          {"messages", report.saved.messages},
                                          {"chunks", report.saved.chunks},
                                          {"problems", std::move(problems)}});
    return;
  }
  for (const mcap::Problem& problem : report.problems.described()) {
    fmt::print("{}: {}\n", options.file.string(), base::text::safe(problem.to_string()));
  }
  fmt::print("{}: {} messages in {} chunks\n", output.string(), report.saved.messages,
             report.saved.chunks);
}

int repair(const RepairOptions& options) {
  const std::filesystem::path output =
      options.output.empty() ? mcap::repaired_name(options.file) : options.output;
  const auto done = recorder::repair_recording(options.file, output, library_name());
  if (!done) {
    throw std::runtime_error(done.error());
  }
  show(options, output, *done);
  return base::program::exit_done;
}

}  // namespace

void add_repair(CLI::App& recording, Chosen& chosen) {
  auto options = std::make_shared<RepairOptions>();
  CLI::App& command =
      add_subcommand(recording, "repair",
                     "Write what can be read of a cut or damaged recording to a new, whole file",
                     "millrace recording repair run.mcap.part -o run.mcap");
  add_file(command, options->file);
  command
      .add_option("-o,--output", options->output,
                  "The new file; by default FILE with .repaired before .mcap")
      ->type_name("FILE");
  add_json(command, options->json);
  run_if_chosen(command, chosen, options, repair);
}

}  // namespace millrace::tools::commands::recordings
