#include "tools/commands/calls/timeline_text.hpp"

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::calls {

namespace {

using recording::Timeline;
using recording::TimelineStep;

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

}  // namespace

std::string text_of(const Timeline& timeline) {
  std::string text =
      fmt::format("call {} of {}, service {}{}\n\n", timeline.call.to_string(),
                  base::text::safe(timeline.key.to_string()), base::text::safe(timeline.uuid),
                  timeline.replayed ? ", replayed" : "");
  print::Table table({{"TIME"},
                      {"AFTER", print::Align::right},
                      {"ATTEMPT", print::Align::right},
                      {"HOP"},
                      {"WHAT"}});
  const fabric::Time start = timeline.steps.front().at;
  if (timeline.steps.front().stage == recording::Stage::seen) {
    table.add({"", "", "", "written by the program", "up to one poll earlier; not timestamped"});
  }
  for (const TimelineStep& step : timeline.steps) {
    table.add({print::clock_text(step.at), print::duration_text(step.at - start),
               step.attempt == 0 ? "" : std::to_string(step.attempt),
               std::string(name_of(step.stage)) + (step.by_service ? " *" : ""), what_of(step)});
  }
  text += table.text() + "\n* by the clock of the service's host";
  if (timeline.clock_difference != std::chrono::nanoseconds{}) {
    text += fmt::format(", which differs by at least {}",
                        print::duration_text(timeline.clock_difference));
  }
  return text + '\n';
}

}  // namespace millrace::tools::commands::calls
