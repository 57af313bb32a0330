#include "tools/commands/status/problems.hpp"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "tools/print/data.hpp"

namespace millrace::tools::commands::status {

namespace {

using base::program::exit_done;
using base::program::exit_failed;

using Problems = std::vector<Problem>;

/// Discovery shows them, and they send no heartbeat.
void add_silent_instances(Problems& problems, const bus::FabricModel& live) {
  for (const auto& [id, gone] : live.gone()) {
    const fabric::InstanceIdentity& identity = gone.last.identity;
    problems.push_back({exit_failed, "NO HEARTBEAT", identity.name, gone.at,
                        fmt::format("{} on {}, pid {}: its process is frozen or has ended",
                                    id.to_string(), identity.host, identity.pid),
                        "restart it"});
  }
}

void add_machines(Problems& problems, const bus::FabricModel& live) {
  if (std::ranges::none_of(live.machines(), [](const auto& one) { return !one.second.gone; })) {
    problems.push_back({exit_link_down,
                        "NO GATEWAY",
                        "-",
                        {},
                        "no gateway reports on this fabric: no controller is asked for calls",
                        "start millrace-gateway"});
    return;
  }
  // A gateway that stands by has no link, and needs none.
  std::map<std::string, const fabric::MachineStatus*> machines;
  for (const auto& [key, status] : live.machines()) {
    const fabric::MachineStatus*& best = machines[status.machine];
    if (best == nullptr || status.connected || (!best->connected && !status.gone)) {
      best = &status;
    }
  }
  for (const auto& [name, status] : machines) {
    if (!status->connected) {
      problems.push_back({exit_link_down, status->gone ? "NO GATEWAY" : "LINK DOWN", name,
                          status->since, status->reason, ""});
    }
  }
}

void add_channels(Problems& problems, const bus::FabricModel& live, fabric::Time now,
                  const std::string& flags) {
  for (const auto& [key, status] : live.channels()) {
    const std::string name = key.to_string();
    switch (live.obstacle_of(status, now)) {
      case bus::Obstacle::none:
      case bus::Obstacle::journal:  // An alarm of its gateway.
      case bus::Obstacle::busy:
        break;
      case bus::Obstacle::held:
        problems.push_back(
            {exit_held, "HELD", name, status.since, status.reason,
             fmt::format("check the machine, then 'millrace answer {0}{1} TEXT --state N' or "
                         "'millrace retry {0}{1}'",
                         base::text::shell_word(name), flags)});
        break;
      case bus::Obstacle::unserved:
        problems.push_back(
            {exit_unserved, "NO SERVICE", name, status.since, status.reason, "start the service"});
        break;
      case bus::Obstacle::long_busy:
        problems.push_back(
            {exit_unserved, "WAITING", name, status.since,
             fmt::format("all instances of {} are busy: {}", status.uuid, status.reason),
             "start more instances"});
        break;
    }
  }
}

void add_alarms(Problems& problems, const bus::FabricModel& live) {
  std::set<std::string> services;
  for (const auto& [key, alarm] : live.alarms()) {
    if (key.kind == "service") {
      // Each gateway reports a service that has lost its last instance.
      if (live.instances_of(key.subject).empty() && services.insert(key.subject).second) {
        problems.push_back(
            {exit_unserved, "NO SERVICE", key.subject, alarm.since, alarm.text, alarm.advice});
      }
    } else if (alarm.level != fabric::AlarmLevel::fine) {
      const bool is_warning = alarm.level == fabric::AlarmLevel::warning;
      problems.push_back({is_warning ? exit_done : exit_alarm, is_warning ? "WARNING" : "ALARM",
                          print::reported_by(alarm), alarm.since, alarm.text, alarm.advice});
    }
  }
}

}  // namespace

Problems problems_of(const bus::FabricModel& live, fabric::Time now, const std::string& flags) {
  Problems problems;
  add_silent_instances(problems, live);
  add_machines(problems, live);
  add_channels(problems, live, now, flags);
  add_alarms(problems, live);
  return problems;
}

Problems missing_gateways(const bus::FabricModel& live, const std::vector<std::string>& names) {
  Problems problems;
  for (const std::string& name : names) {
    const bool is_there = std::ranges::any_of(live.machines(), [&](const auto& one) {
      return !one.second.gone && (one.second.machine == name || one.second.host == name);
    });
    if (!is_there) {
      problems.push_back(
          {exit_failed,
           "NO GATEWAY",
           name,
           {},
           fmt::format("no gateway of machine '{}', or on a host of that name, reports", name),
           "start it"});
    }
  }
  return problems;
}

Problems missing_instances(const bus::FabricModel& live, const Expected& services) {
  Problems problems;
  for (const auto& [what, count] : services) {
    const auto instances = live.instances_of(what);
    const auto there = static_cast<std::size_t>(std::ranges::count_if(
        instances,
        [](const bus::KnownInstance* instance) { return !instance->identity.draining; }));
    if (there < count) {
      problems.push_back({exit_failed,
                          "INSTANCES",
                          what,
                          {},
                          fmt::format("{} of {} expected instances", there, count),
                          "start the others"});
    }
  }
  return problems;
}

void sort(Problems& problems) {
  std::ranges::stable_sort(problems, {}, [](const Problem& problem) {
    return std::tuple(problem.code == exit_done, problem.code, problem.since == fabric::Time{},
                      problem.since);
  });
}

int exit_code_of(const Problems& problems) {
  int worst = exit_done;
  for (const Problem& problem : problems) {
    if (problem.code != exit_done) {
      worst = worst == exit_done ? problem.code : std::min(worst, problem.code);
    }
  }
  return worst;
}

}  // namespace millrace::tools::commands::status
