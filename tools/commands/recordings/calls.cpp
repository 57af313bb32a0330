// millrace recording calls: the calls of a recording, or one of them over every hop.
#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/calls/call_list.hpp"
#include "tools/commands/listing_flags.hpp"
#include "tools/commands/recordings/recordings.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::commands::recordings {

namespace {

struct CallsOptions {
  explicit CallsOptions(CLI::App& command) : output(command) {
    add_file(command, file);
    output.exclude(add_call(command, "CALL", call, "Only this call, with each step"));
    add_filter(command, filter);
    add_time_filter(command, filter);
  }

  ListingFlags output;
  std::filesystem::path file;
  fabric::CallId call;
  recording::Filter filter;
};

int list(const CallsOptions& options) {
  mcap::FileSource source = open(options.file);
  calls::CallList calls(std::numeric_limits<std::size_t>::max());
  const auto read = recording::read_entries(
      source, options.filter, [&](const recording::Entry& entry) { calls.add(entry); });
  std::vector<calls::CallRow> rows = calls.rows();
  std::ranges::reverse(rows);  // In the order of the recording.
  print_listing(calls::recorded_listing(), rows, options.output);
  return report(options.file, read.problems, read.has_read);
}

int show(const CallsOptions& options) {
  mcap::FileSource source = open(options.file);
  recording::Call call(options.call);
  const auto read = recording::read_entries(
      source, {.call = options.call}, [&](const recording::Entry& entry) { call.add(entry); });
  const recording::Timeline timeline = recording::timeline_of(call);
  if (timeline.steps.empty()) {
    fmt::print(stderr, "millrace: no call {} in {}; 'millrace recording calls' lists them\n",
               options.call.to_string(), options.file.string());
    return base::program::exit_failed;
  }
  if (options.output.json) {
    print::print_json(print::json_of(timeline));
  } else {
    fmt::print("{}", print::text_of(timeline));
  }
  return report(options.file, read.problems, read.has_read);
}

}  // namespace

void add_calls(CLI::App& recording, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      recording, "calls", "The calls of a recording, or one of them with the time of each step",
      "millrace recording calls run.mcap\n"
      "  millrace recording calls run.mcap 5f3a9c0112d4-17");
  auto options = std::make_shared<CallsOptions>(command);
  run_if_chosen(command, chosen, options, [](const auto& wanted) {
    return wanted.call == fabric::CallId{} ? list(wanted) : show(wanted);
  });
}

}  // namespace millrace::tools::commands::recordings
