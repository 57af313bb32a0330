// millrace log timeline: one call over every hop.
#include "tools/recording/timeline.hpp"

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/log/log.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"
#include "tools/print/timeline_json.hpp"
#include "tools/print/units.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::commands::log {

namespace {

using recording::Timeline;
using recording::TimelineStep;

struct TimelineOptions {
  std::filesystem::path file;
  fabric::CallId call;
  bool json = false;
};

std::string what_of(const TimelineStep& step) {
  std::string what;
  if (step.withheld) {
    what = fmt::format("({} bytes, not recorded)", *step.withheld);
  } else if (!step.text.empty() || step.state != 0) {
    what = fmt::format("{} state {}", base::text::quoted(step.text), step.state);
  }
  if (!step.detail.empty()) {
    what += (what.empty() ? "" : "  ") + base::text::safe(step.detail);
  }
  return what;
}

void print_text(const Timeline& timeline) {
  fmt::print("call {} of {}, service {}{}\n\n", timeline.call.to_string(),
             base::text::safe(timeline.key.to_string()), base::text::safe(timeline.uuid),
             timeline.replayed ? ", replayed" : "");
  print::Table table({{"TIME"},
                      {"AFTER", print::Align::right},
                      {"ATTEMPT", print::Align::right},
                      {"HOP"},
                      {"WHAT"}});
  const fabric::Time start = timeline.steps.front().at;
  if (timeline.steps.front().stage == recording::Stage::seen) {
    table.add({"", "", "", "written by the program",
               "at most one poll earlier; its time is not recorded"});
  }
  for (const TimelineStep& step : timeline.steps) {
    table.add({print::clock_text(step.at), print::duration_text(step.at - start),
               step.attempt == 0 ? "" : std::to_string(step.attempt),
               std::string(name_of(step.stage)) + (step.by_service ? " *" : ""), what_of(step)});
  }
  fmt::print("{}\n* by the clock of the service's host", table.text());
  if (timeline.clock_difference != std::chrono::nanoseconds{}) {
    fmt::print(", which differs by at least {}", print::duration_text(timeline.clock_difference));
  }
  fmt::print("\n");
}

int show(const TimelineOptions& options) {
  mcap::FileSource source = open(options.file);
  recording::TimelineBuilder builder(options.call);
  const auto read = recording::read_entries(
      source, {.call = options.call}, [&](const recording::Entry& entry) { builder.add(entry); });
  const Timeline timeline = builder.build();
  if (timeline.steps.empty()) {
    fmt::print(stderr, "millrace: no call {} in {}; 'millrace log cat --kind request' lists them\n",
               options.call.to_string(), options.file.string());
    return base::program::exit_failed;
  }
  if (options.json) {
    print::print_json(print::json_of(timeline));
  } else {
    print_text(timeline);
  }
  return report(options.file, read.problems);
}

}  // namespace

void add_timeline(CLI::App& log, Chosen& chosen) {
  auto options = std::make_shared<TimelineOptions>();
  CLI::App& command = add_subcommand(log, "timeline", "One call with the time of each hop",
                                     "millrace log timeline run.mcap 5f3a9c0112d4-17");
  add_file(command, options->file);
  add_call(command, "CALL", options->call, "The call, as `log cat` names it")->required();
  add_json(command, options->json);
  command.callback([options, &chosen] { chosen.run = [options] { return show(*options); }; });
}

}  // namespace millrace::tools::commands::log
