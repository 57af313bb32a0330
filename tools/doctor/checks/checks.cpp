#include "tools/doctor/checks/checks.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <set>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "base/text/quoted.hpp"
#include "tools/print/data.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::doctor::checks {

namespace {

namespace messages = base::messages;
using base::text::safe;

}  // namespace

std::string list_of(const std::set<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    text += (text.empty() ? "" : ", ") + safe(name);
  }
  return text;
}

Report::Message program_text(const Announcement& who) {
  const std::string& name = who.name.empty() ? who.process : who.name;
  if (!name.empty() && !who.host.empty() && !who.pid.empty()) {
    return messages::process_on_host(safe(name), safe(who.host), safe(who.pid));
  }
  return fmt::format("{}{}{}", name.empty() ? "a process" : safe(name),
                     who.host.empty() ? "" : " on " + safe(who.host),
                     who.pid.empty() ? "" : ", pid " + safe(who.pid));
}

Report::Message program_text(const Program& program) {
  return program_text(Announcement{.name = program.name, .host = program.host, .pid = program.pid});
}

void Report::concern(const fabric::plant::Concern& concern) {
  const Message reason =
      concern.why.empty() ? concern.what : messages::about(concern.what, concern.why);
  const Message subject = subject_of(concern);
  diagnoses_.push_back(
      {concern.level == fabric::plant::Level::act ? Severity::problem : Severity::warning,
       subject.empty() ? reason : messages::about(subject, reason), concern.todo});
}

void at_endpoints(const Findings& found, Report& report) {
  for (const Misfit& misfit : found.misfits) {
    for (const Report::Message& reason : misfit.reasons) {
      report.problem(misfit.writer
                         ? messages::writer_does_not_match(misfit.topic, misfit.program, reason)
                         : messages::reader_does_not_match(misfit.topic, misfit.program, reason),
                     messages::give_it_qos());
    }
  }
  for (const messages::Message& each : found.ignored) {
    report.problem(each, messages::start_this_version());
  }
}

namespace {

/// Each process of this fabric that does not understand another one, once.
void at_wire_versions(const Findings& found, Report& report) {
  const auto is_here = [&](const Program& program) {
    return program.fabrics.contains(found.joining.fabric);
  };
  for (const Program& program : found.programs) {
    const auto later = std::ranges::find_if(found.programs, [&](const Program& other) {
      return is_here(other) && is_too_old_for(program.version, other.version);
    });
    if (is_here(program) && later != found.programs.end()) {
      report.problem(
          messages::wire_version_differs(program_text(program), wire_text(program.version),
                                         wire_text(later->version), program_text(*later)),
          messages::upgrade_process(program_text(program)));
    }
  }
}

}  // namespace

void at_versions(const Findings& found, Report& report) {
  at_wire_versions(found, report);
  for (const auto& [key, status] : found.live.machines()) {
    if (!status.version.empty() && status.version != found.joining.version) {
      report.warning(messages::gateway_version_differs(safe(status.machine), safe(status.version),
                                                       found.joining.version),
                     messages::install_one_version());
    }
  }
  std::map<std::string, std::set<std::string>> versions;
  for (const auto& [id, instance] : found.live.instances()) {
    versions[instance.identity.uuid].insert(instance.identity.version);
  }
  for (const auto& [uuid, all] : versions) {
    if (all.size() > 1) {
      report.warning(messages::versions_differ(safe(uuid), list_of(all)),
                     messages::drain_old_instances());
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
    const std::string difference = print::duration_text(std::chrono::abs(ahead));
    const std::string error = print::duration_text(clock.difference.error);
    const Report::Message text =
        ahead < std::chrono::nanoseconds::zero()
            ? messages::clock_behind(safe(clock.host), difference, error, safe(clock.program))
            : messages::clock_ahead(safe(clock.host), difference, error, safe(clock.program));
    if (sure > large_difference) {
      report.problem(text, messages::synchronise_for_deadlines());
    } else if (sure > small_difference) {
      report.warning(text, messages::synchronise_for_recordings());
    } else {
      report.fine(text);
    }
  }
}

void at_alarms(const Findings& found, Report& report) {
  for (const auto& [key, alarm] : found.live.alarms()) {
    if (alarm.level == fabric::AlarmLevel::fine) {
      report.fine(messages::about(print::reported_by(alarm), alarm.text));
    }
  }
  if (found.live.too_many_alarms()) {
    report.warning(messages::too_many_alarms(fabric::plant::Plant::most_alarms),
                   messages::find_flooding_process());
  }
}

}  // namespace millrace::tools::doctor::checks
