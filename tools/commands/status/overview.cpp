#include "tools/commands/status/overview.hpp"

#include <algorithm>
#include <set>

#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/words.hpp"
#include "tools/commands/look/machines.hpp"
#include "tools/print/data.hpp"
#include "tools/print/json.hpp"
#include "tools/print/listing.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::status {

namespace {

using print::Align;
using print::Cell;

/// What to do is below each, and so is what does not fit.
std::string problems_text(const std::vector<Problem>& problems, std::size_t width,
                          fabric::Time now) {
  std::size_t kind = 0;
  std::size_t subject = 0;
  for (const Problem& problem : problems) {
    kind = std::max(kind, problem.kind.size());
    subject = std::max(subject, print::width(base::text::safe(problem.subject)));
  }
  std::string text;
  for (const Problem& problem : problems) {
    const std::string age =
        problem.since == fabric::Time{}
            ? "-"
            : print::age_text(std::max(now - problem.since, fabric::Time::duration{}));
    text += print::wrapped(fmt::format("{:<{}}  {:<{}}  {:>6}  {}", problem.kind, kind,
                                       base::text::safe(problem.subject), subject, age,
                                       base::text::safe(problem.text)),
                           width, kind + 2);
    if (!problem.advice.empty()) {
      text +=
          print::wrapped(fmt::format("{:<{}}  -> {}", "", kind, base::text::safe(problem.advice)),
                         width, kind + 5);
    }
  }
  return text;
}

Cell channels_of(const MachineRow& row) {
  std::vector<std::string> states;
  for (const auto& [state, count] : row.channels) {
    states.push_back(fmt::format("{} {}", count, name_of(state)));
  }
  return fmt::format("{}", fmt::join(states, ", "));
}

const print::Listing<MachineRow>& machines_listing() {
  static const print::Listing<MachineRow> machines{
      {"MACHINE", "", [](const auto& row) -> Cell { return row.status->machine; }},
      {"LINK", "", [](const auto& row) -> Cell { return look::link_of(*row.status); }},
      {"SINCE", "", [](const auto& row) -> Cell { return row.status->since; }, Align::right, 1},
      {"CHANNELS", "", &channels_of},
      {"GATEWAY", "",
       [](const auto& row) -> Cell {
         return row.status->gone ? Cell()
                                 : fmt::format("{} ({})", row.status->host, row.status->pid);
       },
       Align::left, 2}};
  return machines;
}

boost::json::object json_of(const Problem& problem) {
  boost::json::object out{{"problem", problem.kind},
                          {"subject", print::utf8(problem.subject)},
                          {"exit_code", problem.code},
                          {"text", print::utf8(problem.text)},
                          {"advice", print::utf8(problem.advice)}};
  print::put_time(out, "since", problem.since);
  return out;
}

std::string plural(std::size_t count, const std::string& noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

std::string counts_text(const Overview& overview) {
  const bus::FabricModel& live = overview.live;
  std::set<std::string> services;
  for (const bus::KnownInstance* instance : live.instances_of("")) {
    services.insert(instance->identity.uuid);
  }
  return fmt::format(
      "fabric '{}', domain {}: {}; {}, {}, {}", overview.fabric, overview.domain,
      overview.problems.empty() ? "no problem" : plural(overview.problems.size(), "problem"),
      plural(live.channels().size(), "channel"), plural(services.size(), "service"),
      plural(live.instances().size(), "instance"));
}

}  // namespace

std::vector<MachineRow> machine_rows(const bus::FabricModel& live, const Host& host) {
  std::map<std::string, MachineRow> machines;
  for (const auto& [key, status] : live.machines()) {
    const auto gateway = live.gateways().find(key.second);
    if (gateway != live.gateways().end() && !is_on(host, gateway->second.host)) {
      continue;
    }
    MachineRow& row = machines[status.machine];
    if (row.status == nullptr || status.connected || (!row.status->connected && !status.gone)) {
      row.status = &status;
    }
  }
  for (const auto& [key, status] : live.channels()) {
    const auto row = machines.find(std::string(fabric::machine_of(key.machine)));
    if (row != machines.end()) {
      ++row->second.channels[status.state];
    }
  }
  std::vector<MachineRow> rows;
  for (const auto& [name, row] : machines) {
    rows.push_back(row);
  }
  std::ranges::stable_partition(rows, [](const MachineRow& row) { return !row.status->connected; });
  return rows;
}

std::vector<fabric::Alarm> alarms_on(const bus::FabricModel& live, const Host& host) {
  std::vector<fabric::Alarm> alarms;
  for (const auto& [key, alarm] : live.alarms()) {
    if (is_on(host, alarm.host)) {
      alarms.push_back(alarm);
    }
  }
  return alarms;
}

std::string text_of(const Overview& overview, std::size_t width, fabric::Time now) {
  std::string reports;
  for (const fabric::Alarm& alarm : alarms_on(overview.live, overview.host)) {
    if (alarm.level == fabric::AlarmLevel::fine) {
      reports += print::wrapped(print::reported_problems(alarm), width, 2);
    }
  }
  const std::vector<MachineRow> machines = machine_rows(overview.live, overview.host);
  std::string text = print::wrapped(counts_text(overview), width, 2);
  for (const std::string& block :
       {problems_text(overview.problems, width, now),
        machines.empty() ? "" : machines_listing().text(machines, {.width = width}, now),
        overview.answers, reports}) {
    text += block.empty() ? "" : '\n' + block;
  }
  return text;
}

boost::json::object json_of(const Overview& overview) {
  boost::json::array problems;
  for (const Problem& problem : overview.problems) {
    problems.push_back(json_of(problem));
  }
  boost::json::array machines;
  for (const MachineRow& row : machine_rows(overview.live, overview.host)) {
    boost::json::object machine;
    print::put_fields(machine, *row.status);
    machines.push_back(std::move(machine));
  }
  boost::json::array alarms;
  for (const fabric::Alarm& alarm : alarms_on(overview.live, overview.host)) {
    alarms.push_back(print::json_of(alarm));
  }
  return {{"healthy", exit_code_of(overview.problems) == base::program::exit_done},
          {"problems", std::move(problems)},
          {"machines", std::move(machines)},
          {"alarms", std::move(alarms)}};
}

}  // namespace millrace::tools::commands::status
