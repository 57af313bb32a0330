#include "tools/doctor/checks/checks.hpp"

#include <chrono>
#include <map>
#include <set>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/print/data.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::doctor::checks {

namespace {

using base::text::safe;

}  // namespace

std::string list_of(const std::set<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    text += (text.empty() ? "" : ", ") + safe(name);
  }
  return text;
}

std::string program_text(const Announcement& who) {
  const std::string& name = who.name.empty() ? who.process : who.name;
  return fmt::format("{}{}{}", name.empty() ? "a program" : safe(name),
                     who.host.empty() ? "" : " on " + safe(who.host),
                     who.pid.empty() ? "" : ", pid " + safe(who.pid));
}

void at_endpoints(const Findings& found, Report& report) {
  for (const Misfit& misfit : found.misfits) {
    for (const std::string& reason : misfit.reasons) {
      report.problem(
          fmt::format("the {} of {} of {} matches no millrace process: {}",
                      misfit.writer ? "writer" : "reader", misfit.topic, safe(misfit.program),
                      safe(reason)),
          "give it the QoS and types of docs/reference/wire.md and idl/millrace.idl, or the "
          "same version of millrace");
    }
  }
  for (const std::string& each : found.ignored) {
    report.problem(safe(each), "start a millrace service of this version");
  }
}

void at_versions(const Findings& found, Report& report) {
  for (const auto& [key, status] : found.live.machines()) {
    if (!status.version.empty() && status.version != found.joining.version) {
      report.warning(fmt::format("the gateway of {} is millrace {}, this is millrace {}",
                                 safe(status.machine), safe(status.version), found.joining.version),
                     "install one version on all hosts");
    }
  }
  std::map<std::string, std::set<std::string>> versions;
  for (const auto& [id, instance] : found.live.instances()) {
    versions[instance.identity.uuid].insert(instance.identity.version);
  }
  for (const auto& [uuid, all] : versions) {
    if (all.size() > 1) {
      report.warning(fmt::format("the instances of {} have versions {}", safe(uuid), list_of(all)),
                     "normal during an upgrade; otherwise drain the old instances");
    }
  }
}

namespace {

/// A smaller difference is acceptable: recordings stay readable.
constexpr std::chrono::nanoseconds small_difference = std::chrono::milliseconds(100);
/// From here on, times of two hosts cannot be compared.
constexpr std::chrono::nanoseconds large_difference = std::chrono::seconds(10);

}  // namespace

void at_clocks(const Findings& found, Report& report) {
  for (const HostClock& clock : found.clocks) {
    const auto ahead = clock.difference.ahead;
    const auto sure = std::chrono::abs(ahead) - clock.difference.error;
    const std::string text =
        fmt::format("the clock of {} is {} {} this host's (± {}, asked {})", safe(clock.host),
                    print::duration_text(std::chrono::abs(ahead)),
                    ahead < std::chrono::nanoseconds::zero() ? "behind" : "ahead of",
                    print::duration_text(clock.difference.error), safe(clock.program));
    if (sure > large_difference) {
      report.problem(text, "synchronise the hosts (chrony, NTP): deadlines and times are wrong");
    } else if (sure > small_difference) {
      report.warning(text, "synchronise the hosts (chrony, NTP): times in recordings do not agree");
    } else {
      report.fine(text);
    }
  }
}

void at_alarms(const Findings& found, Report& report) {
  for (const auto& [key, alarm] : found.live.alarms()) {
    const std::string what = print::reported_problems(alarm);
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
                   "find the process that publishes them: it may flood millrace/v5/alarm");
  }
}

}  // namespace millrace::tools::doctor::checks
