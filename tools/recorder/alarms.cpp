#include "tools/recorder/alarms.hpp"

#include "base/messages/catalogue.hpp"
#include "tools/print/recording_report.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::recorder {

namespace {

namespace messages = base::messages;
using fabric::AlarmLevel;

/// The multiple of the reserved space below which a warning is due.
constexpr std::uint64_t early = 2;

fabric::Alarm recording_alarm(const Condition& now) {
  if (now.waits_for_room) {
    return {.key = {.kind = "recording"},
            .level = AlarmLevel::problem,
            .text = messages::recorder_without_room(now.file.string(),
                                                    print::size_text(now.minimum_free)),
            .advice = messages::recorder_free_space()};
  }
  return {.key = {.kind = "recording"},
          .level = AlarmLevel::fine,
          .text = now.writes ? messages::records_to(now.writes->string())
                             : messages::records_failures(now.file.string())};
}

}  // namespace

std::vector<fabric::Alarm> alarms_of(const Condition& now) {
  std::vector<fabric::Alarm> alarms{recording_alarm(now)};
  if (now.free && *now.free < early * now.minimum_free && !now.waits_for_room && !now.makes_room) {
    alarms.push_back({.key = {.kind = "disk"},
                      .level = AlarmLevel::warning,
                      .text = messages::recorder_disk_fills(
                          now.file.string(), print::size_text(early * now.minimum_free),
                          print::size_text(now.minimum_free)),
                      .advice = messages::recorder_make_room()});
  }
  if (now.lost > 0 || now.missing.incomplete > 0 || now.missing.unseen > 0) {
    const std::string missing = print::missing_text(now.missing);
    alarms.push_back({.key = {.kind = "missing"},
                      .level = AlarmLevel::warning,
                      .text = now.lost > 0
                                  ? messages::recording_incomplete_and_lost(missing, now.lost)
                                  : messages::recording_incomplete(missing),
                      .advice = messages::recorder_more_time()});
  }
  return alarms;
}

}  // namespace millrace::tools::recorder
