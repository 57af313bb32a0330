#include "tools/recorder/alarms.hpp"

#include <fmt/format.h>

#include "tools/print/recording_report.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::recorder {

namespace {

using fabric::AlarmLevel;

/// The multiple of the reserved space below which a warning is due.
constexpr std::uint64_t early = 2;

fabric::Alarm recording_alarm(const Condition& now) {
  if (now.waits_for_room) {
    return {.key = {.kind = "recording"},
            .level = AlarmLevel::problem,
            .text = fmt::format("nothing is recorded: the disk of {} has less than {} left",
                                now.file.string(), print::size_text(now.minimum_free)),
            .advice = "free space on the disk; the recorder then continues by itself"};
  }
  return {.key = {.kind = "recording"},
          .level = AlarmLevel::fine,
          .text = now.writes ? fmt::format("records to {}", now.writes->string())
                             : fmt::format("writes {} when a call fails", now.file.string())};
}

}  // namespace

std::vector<fabric::Alarm> alarms_of(const Condition& now) {
  std::vector<fabric::Alarm> alarms{recording_alarm(now)};
  if (now.free && *now.free < early * now.minimum_free && !now.waits_for_room && !now.makes_room) {
    alarms.push_back(
        {.key = {.kind = "disk"},
         .level = AlarmLevel::warning,
         .text = fmt::format("the disk of {} has less than {} left; at {} recording stops",
                             now.file.string(), print::size_text(early * now.minimum_free),
                             print::size_text(now.minimum_free)),
         .advice =
             "free space on the disk, or let the recorder remove its oldest files (--keep-size)"});
  }
  if (now.lost > 0 || now.missing.incomplete > 0 || now.missing.unseen > 0) {
    alarms.push_back(
        {.key = {.kind = "missing"},
         .level = AlarmLevel::warning,
         .text =
             fmt::format("the recording is incomplete: {}{}", print::missing_text(now.missing),
                         now.lost > 0 ? fmt::format("; the bus lost {} samples", now.lost) : ""),
         .advice = "give the recorder more processor time; see docs/how-to/record-and-replay.md"});
  }
  return alarms;
}

}  // namespace millrace::tools::recorder
