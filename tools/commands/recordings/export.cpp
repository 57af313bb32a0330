// millrace recording export: calls as CSV, entries as JSON lines.
#include <ostream>

#include <fmt/format.h>

#include "base/posix/output_file.hpp"
#include "base/program/command_line.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/recordings/recordings.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::commands::recordings {

namespace {

struct ExportOptions {
  std::filesystem::path file;
  std::string output;
  std::string format = "jsonl";
  recording::Filter filter;
};

int export_file(const ExportOptions& options) {
  base::posix::OutputFile file;
  if (const auto opened = file.open(options.output); !opened) {
    throw base::program::UsageError("-o: " + opened.error());
  }
  std::ostream& out = file.stream();
  mcap::FileSource source = open(options.file);
  recording::ReadReport read;
  if (options.format == "csv") {
    const print::Csv csv(options.filter.kinds);
    out << csv.header();
    read = recording::read_entries(source, options.filter,
                                   [&](const recording::Entry& entry) { out << csv.row(entry); });
  } else {
    read = recording::read_entries(source, options.filter, [&](const recording::Entry& entry) {
      out << print::json_text(print::json_of(entry)) << '\n';
    });
  }
  if (const auto done = file.finish(); !done) {
    fmt::print(stderr, "millrace: {}\n", done.error());
    return base::program::exit_failed;
  }
  return report(options.file, read.problems, read.has_read);
}

}  // namespace

void add_export(CLI::App& recording, Chosen& chosen) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App& command =
      add_subcommand(recording, "export", "Entries as CSV for a spreadsheet, or as JSON lines",
                     "millrace recording export --format csv -o calls.csv run.mcap");
  add_file(command, options->file);
  command.add_option("--format", options->format, "csv or jsonl")
      ->check(CLI::IsMember({"csv", "jsonl"}))
      ->capture_default_str();
  command.add_option("-o,--output", options->output, "Write here instead of to standard output")
      ->type_name("FILE");
  add_recording_filter(command, options->filter);
  run_if_chosen(command, chosen, options, export_file);
}

}  // namespace millrace::tools::commands::recordings
