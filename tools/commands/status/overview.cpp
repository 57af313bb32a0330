#include "tools/commands/status/overview.hpp"

#include <algorithm>
#include <set>

#include <boost/json/array.hpp>
#include <fmt/chrono.h>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/plant/assess.hpp"
#include "fabric/words.hpp"
#include "tools/commands/look/machines.hpp"
#include "tools/print/data.hpp"
#include "tools/print/json.hpp"
#include "tools/print/listing.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::status {

namespace {

using fabric::plant::Concern;
using print::Align;
using print::Cell;

/// A longer list of subjects moves no other line.
constexpr std::size_t widest_subject = 32;

/// "GATEWAY GONE"; what is only to be known is in small letters.
std::string kind_of(const Concern& concern) {
  std::string kind(name_of(concern.kind));
  if (concern.level == fabric::plant::Level::act) {
    std::ranges::transform(kind, kind.begin(), [](char c) {
      return static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
    });
  }
  return kind;
}

/// The first column says what is wrong, but for alarms and a fabric without gateways.
std::string reason_of(const Concern& concern) {
  using fabric::plant::Kind;
  const bool says_what = concern.kind == Kind::alarm || concern.kind == Kind::no_gateway;
  return concern.why.empty() ? concern.what.text
         : says_what         ? concern.what.text + ": " + concern.why.text
                             : concern.why.text;
}

/// ", since 14:03:07Z", of another day ", since 2026-03-01T14:03:07Z"; empty if it is not known.
std::string since_text(fabric::Time since, fabric::Time now) {
  if (since == fabric::Time{}) {
    return "";
  }
  const bool is_today =
      std::chrono::floor<std::chrono::days>(since) == std::chrono::floor<std::chrono::days>(now);
  return fmt::format(fmt::runtime(is_today ? ", since {:%H:%M:%SZ}" : ", since {:%FT%H:%M:%SZ}"),
                     fmt::gmtime(std::chrono::system_clock::to_time_t(since)));
}

/// Who acts and what to do is below each, and so is what does not fit.
std::string concerns_text(const Concerns& concerns, std::size_t width, fabric::Time now) {
  std::size_t kind = 0;
  std::size_t subject = 0;
  for (const Concern& concern : concerns) {
    kind = std::max(kind, kind_of(concern).size());
    subject = std::max(subject, print::width(base::text::safe(subject_of(concern).text)));
  }
  subject = std::min(subject, widest_subject);
  std::string text;
  for (const Concern& concern : concerns) {
    const std::string age =
        concern.since == fabric::Time{}
            ? "-"
            : print::age_text(std::max(now - concern.since, fabric::Time::duration{}));
    text += print::wrapped(fmt::format("{:<{}}  {:<{}}  {:>6}  {}", kind_of(concern), kind,
                                       base::text::safe(subject_of(concern).text), subject, age,
                                       base::text::safe(reason_of(concern))),
                           width, kind + 2);
    if (!concern.todo.empty()) {
      text += print::wrapped(fmt::format("{:<{}}  -> {}{}: {}", "", kind, name_of(concern.who),
                                         since_text(concern.since, now),
                                         base::text::safe(fabric::plant::advice_of(concern.todo))),
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

std::string plural(std::size_t count, const std::string& noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

/// "no problem", "2 problems, 1 to look at"
std::string counted(const Concerns& concerns) {
  const auto problems = static_cast<std::size_t>(
      std::ranges::count(concerns, fabric::plant::Level::act, &Concern::level));
  const std::size_t others = concerns.size() - problems;
  return (problems == 0 ? "no problem" : plural(problems, "problem")) +
         (others == 0 ? "" : fmt::format(", {} to look at", others));
}

std::string counts_text(const Overview& overview) {
  const fabric::plant::Plant& live = overview.live;
  std::set<std::string> services;
  for (const fabric::plant::KnownInstance* instance : live.instances_of("")) {
    services.insert(instance->identity.uuid);
  }
  return fmt::format("fabric '{}', domain {}: {}; {}, {}, {}", overview.fabric, overview.domain,
                     counted(overview.concerns), plural(live.channels().size(), "channel"),
                     plural(services.size(), "service"),
                     plural(live.instances().size(), "instance"));
}

}  // namespace

std::vector<MachineRow> machine_rows(const fabric::plant::Plant& live, const Host& host) {
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

std::vector<fabric::Alarm> alarms_on(const fabric::plant::Plant& live, const Host& host) {
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
       {concerns_text(overview.concerns, width, now),
        machines.empty() ? "" : machines_listing().text(machines, {.width = width}, now),
        overview.answers, reports}) {
    text += block.empty() ? "" : '\n' + block;
  }
  return text;
}

boost::json::object json_of(const Overview& overview) {
  boost::json::array concerns = print::json_of(overview.concerns);
  for (std::size_t i = 0; i < concerns.size(); ++i) {
    concerns[i].as_object()["exit_code"] = exit_code_of(overview.concerns[i]);
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
  return {{"healthy", level_of(overview.concerns) != fabric::plant::Level::act},
          {"concerns", std::move(concerns)},
          {"machines", std::move(machines)},
          {"alarms", std::move(alarms)}};
}

}  // namespace millrace::tools::commands::status
