// millrace recording cat: the entries of a recording, one line each.
#include <fmt/format.h>

#include "tools/commands/arguments.hpp"
#include "tools/commands/recordings/recordings.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::commands::recordings {

namespace {

struct CatOptions {
  std::filesystem::path file;
  recording::Filter filter;
  bool json = false;
};

int print_entries(const CatOptions& options) {
  mcap::FileSource source = open(options.file);
  const auto report_read =
      recording::read_entries(source, options.filter, [&](const recording::Entry& entry) {
        if (options.json) {
          print::print_json(print::json_of(entry));
        } else {
          fmt::print("{}\n", print::line_of(entry));
        }
      });
  if (report_read.foreign > 0) {
    fmt::print(stderr, "{}: {} messages of other applications are not shown\n",
               options.file.string(), report_read.foreign);
  }
  return report(options.file, report_read.problems, report_read.has_read);
}

}  // namespace

void add_cat(CLI::App& recording, Chosen& chosen) {
  auto options = std::make_shared<CatOptions>();
  CLI::App& command =
      add_subcommand(recording, "cat", "The entries of a recording, one line each",
                     "millrace recording cat --machine cnc --kind request run.mcap");
  add_file(command, options->file);
  add_recording_filter(command, options->filter);
  add_json(command, options->json);
  run_if_chosen(command, chosen, options, print_entries);
}

}  // namespace millrace::tools::commands::recordings
