#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/doctor/checks/checks.hpp"
#include "tools/print/alarm_text.hpp"

namespace millrace::tools::doctor::checks {

void at_alarms(const Findings& found, Report& report) {
  for (const auto& [key, alarm] : found.live.alarms()) {
    const std::string what = print::what_is_said(alarm);
    const std::string advice = base::text::safe(alarm.advice);
    switch (alarm.level) {
      case fabric::AlarmLevel::fine:
        report.fine(what);
        break;
      case fabric::AlarmLevel::warning:
        report.warning(what, advice);
        break;
      default:
        // An unknown level of a newer version counts as a problem.
        report.problem(what, advice);
        break;
    }
  }
  if (found.live.too_many_alarms()) {
    report.warning(fmt::format("there are more than {} alarms; further ones are ignored",
                               bus::FabricModel::most_alarms),
                   "find the process that publishes them: it may flood millrace/alarm");
  }
}

}  // namespace millrace::tools::doctor::checks
