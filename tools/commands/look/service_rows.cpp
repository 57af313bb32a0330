#include "tools/commands/look/service_rows.hpp"

#include <algorithm>
#include <map>
#include <set>

#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "fabric/channel_scope.hpp"
#include "fabric/plant/channel_view.hpp"
#include "fabric/words.hpp"
#include "tools/print/data.hpp"

namespace millrace::tools::commands::look {

namespace {

using print::Align;
using print::Cell;
using print::only_wide;

struct Service {
  ServiceRow row{};
  std::set<std::string> names{};
  std::chrono::nanoseconds busy{};
  std::vector<std::string> problems{};
};

void add(Service& service, const fabric::plant::KnownInstance& instance) {
  ServiceRow& row = service.row;
  service.names.insert(instance.identity.name);
  row.instances.push_back(&instance);
  row.capacity += instance.identity.concurrency;
  if (instance.status) {
    const fabric::InstanceStatus& status = *instance.status;
    row.running += status.running;
    row.answered += status.answered;
    row.failed += status.failed;
    service.busy += status.mean * static_cast<std::int64_t>(status.answered);
  }
}

void finish(Service& service) {
  ServiceRow& row = service.row;
  row.name = fmt::format("{}", fmt::join(service.names, ", "));
  if (row.answered > 0) {
    row.mean = service.busy / static_cast<std::int64_t>(row.answered);
  }
  if (row.instances.empty()) {
    service.problems.insert(service.problems.begin(), "no running instance");
  }
  row.problem = fmt::format("{}", fmt::join(service.problems, "; "));
}

double load_of(const ServiceRow& row) {
  return row.capacity == 0 ? 0
                           : static_cast<double>(row.running) / static_cast<double>(row.capacity);
}

template <typename Number>
Cell number(Number value) {
  return static_cast<std::int64_t>(value);
}

const fabric::InstanceIdentity& identity_of(const InstanceRow& row) {
  return row.instance->identity;
}
const fabric::InstanceStatus* status_of(const InstanceRow& row) {
  return row.instance->status ? &*row.instance->status : nullptr;
}

template <auto member>
Cell count(const InstanceRow& row) {
  const fabric::InstanceStatus* status = status_of(row);
  return status == nullptr ? Cell() : number(status->*member);
}
template <auto member>
Cell moment(const InstanceRow& row) {
  const fabric::InstanceStatus* status = status_of(row);
  return status == nullptr ? Cell() : Cell(status->*member);
}
Cell mean_of(const InstanceRow& row) {
  const fabric::InstanceStatus* status = status_of(row);
  return status == nullptr || status->answered == 0 ? Cell() : Cell(status->mean);
}
Cell busy_of(const InstanceRow& row) {
  const fabric::InstanceStatus* status = status_of(row);
  return status == nullptr ? Cell()
                           : fmt::format("{}/{}", status->running, identity_of(row).concurrency);
}

Cell problem_of(const InstanceRow& row) {
  std::vector<std::string> problems;
  if (row.is_gone) {
    problems.emplace_back("no heartbeat; its process is frozen or has ended");
  }
  if (identity_of(row).draining) {
    problems.emplace_back("draining");
  }
  for (const fabric::Alarm* alarm : row.alarms) {
    if (alarm->level != fabric::AlarmLevel::fine) {
      problems.push_back(alarm->text);
    }
  }
  return fmt::format("{}", fmt::join(problems, "; "));
}

Cell alarms_of(const InstanceRow& row) {
  boost::json::array all;
  for (const fabric::Alarm* alarm : row.alarms) {
    all.push_back(print::json_of(*alarm));
  }
  return all.empty() ? Cell() : Cell(boost::json::value(std::move(all)));
}

Cell answer_of(const InstanceRow& row) {
  return !row.was_asked ? Cell() : row.answer ? row.answer->outcome.detail : "no answer";
}

}  // namespace

std::vector<ServiceRow> service_rows(const fabric::plant::Plant& live, fabric::Time now) {
  std::map<std::string, Service> services;
  for (const fabric::plant::KnownInstance* instance : live.instances_of("")) {
    add(services[instance->identity.uuid], *instance);
  }
  for (const auto& [id, gone] : live.gone()) {
    const fabric::InstanceIdentity& last = gone.last.identity;
    Service& service = services[last.uuid];
    service.names.insert(last.name);
    service.problems.push_back(
        fmt::format("{} without heartbeat ({}, pid {})", last.name, last.host, last.pid));
  }
  for (const auto& [key, status] : live.channels()) {
    const fabric::plant::ChannelView view = view_of(live, status, now);
    const bool waits = view.call == name_of(fabric::ChannelState::unserved) ||
                       view.call == name_of(fabric::ChannelState::waiting);
    if (!status.uuid.empty() && waits) {
      Service& service = services[fabric::canonical_uuid(status.uuid)];
      ++service.row.waiting;
      if (view.call == name_of(fabric::ChannelState::waiting) &&
          view.call_level == fabric::plant::Level::act) {
        service.problems.push_back(fmt::format("{} waits for a free instance", key.to_string()));
      }
    }
  }
  for (const auto& [key, alarm] : live.alarms()) {
    const auto instance = live.instances().find(key.responder);
    if (instance != live.instances().end() && alarm.level != fabric::AlarmLevel::fine) {
      services[instance->second.identity.uuid].problems.push_back(alarm.text);
    } else if (key.kind == "service" && live.instances_of(key.subject).empty()) {
      // Each gateway says that it has lost its last instance.
      std::vector<std::string>& problems = services[fabric::canonical_uuid(key.subject)].problems;
      if (std::ranges::find(problems, alarm.text.text) == problems.end()) {
        problems.push_back(alarm.text);
      }
    }
  }
  std::vector<ServiceRow> rows;
  for (auto& [uuid, service] : services) {
    service.row.uuid = uuid;
    finish(service);
    rows.push_back(std::move(service.row));
  }
  std::ranges::stable_sort(rows, [](const ServiceRow& a, const ServiceRow& b) {
    return std::tuple(a.problem.empty(), -load_of(a), a.name) <
           std::tuple(b.problem.empty(), -load_of(b), b.name);
  });
  return rows;
}

const print::Listing<ServiceRow>& services_listing() {
  static const print::Listing<ServiceRow> services{
      {"SERVICE", "", [](const auto& row) -> Cell { return service_text(row.name, row.uuid); }},
      {"", "name", [](const auto& row) -> Cell { return row.name; }},
      {"UUID", "uuid", [](const auto& row) -> Cell { return row.uuid; }, Align::left, 5},
      {"INSTANCES", "instances", [](const auto& row) { return number(row.instances.size()); },
       Align::right, 1},
      {"BUSY", "",
       [](const auto& row) -> Cell {
         return row.instances.empty() ? Cell() : fmt::format("{}/{}", row.running, row.capacity);
       },
       Align::right, 2},
      {"", "running", [](const auto& row) { return number(row.running); }},
      {"", "capacity", [](const auto& row) { return number(row.capacity); }},
      {"WAITING", "waiting", [](const auto& row) { return number(row.waiting); }, Align::right, 3},
      {"CALLS", "answered_calls", [](const auto& row) { return number(row.answered); },
       Align::right, 4},
      {"ERRORS", "failed", [](const auto& row) { return number(row.failed); }, Align::right, 4},
      {"MEAN", "mean_ms",
       [](const auto& row) -> Cell { return row.mean ? Cell(*row.mean) : Cell(); }, Align::right,
       4},
      {"PROBLEM", "problem", [](const auto& row) -> Cell { return row.problem; }}};
  return services;
}

std::string service_text(const std::string& name, const std::string& uuid) {
  constexpr std::size_t first_group = 8;
  return !name.empty()                ? name
         : uuid.size() <= first_group ? uuid
                                      : print::first_of(uuid, first_group) + "…";
}

std::string channels_text(const fabric::InstanceIdentity& identity) {
  std::vector<std::string> scopes;
  for (const fabric::ChannelScope& scope : identity.channels) {
    scopes.push_back(fabric::format_channel_scope(scope));
  }
  return scopes.empty() ? "all" : fmt::format("{}", fmt::join(scopes, " "));
}

std::vector<InstanceRow> instance_rows(const fabric::plant::Plant& live, bool with_gone) {
  std::vector<InstanceRow> rows;
  if (with_gone) {
    for (const auto& [id, gone] : live.gone()) {
      rows.push_back({.instance = &gone.last, .is_gone = true});
    }
  }
  for (const fabric::plant::KnownInstance* instance : live.instances_of("")) {
    rows.push_back({.instance = instance});
  }
  for (InstanceRow& row : rows) {
    for (const auto& [key, alarm] : live.alarms()) {
      if (key.responder == identity_of(row).id) {
        row.alarms.push_back(&alarm);
      }
    }
  }
  std::ranges::stable_sort(rows, {}, [](const InstanceRow& row) {
    const fabric::InstanceIdentity& identity = identity_of(row);
    return std::tuple(std::get<std::string>(problem_of(row)).empty(), identity.name, identity.host,
                      identity.pid);
  });
  return rows;
}

const print::Listing<InstanceRow>& instances_listing() {
  using Status = fabric::InstanceStatus;
  using Row = InstanceRow;
  static const auto instances =
      print::Listing<Row>{
          {"NAME", "", [](const Row& row) -> Cell { return identity_of(row).name; }},
          {"HOST", "", [](const Row& row) -> Cell { return identity_of(row).host; }, Align::left,
           1},
          {"PID", "", [](const Row& row) { return number(identity_of(row).pid); }, Align::right, 1},
          {"ANSWER", "", &answer_of, Align::left, 1},
          {"AFTER", "after_ms",
           [](const Row& row) -> Cell { return row.answer ? Cell(row.answer->after) : Cell(); },
           Align::right, 1},
          {"BUSY", "", &busy_of, Align::right, 2},
          {"CALLS", "", &count<&Status::answered>, Align::right, 3},
          {"ERRORS", "", &count<&Status::failed>, Align::right, 4},
          {"MEAN", "", &mean_of, Align::right, 4},
          {"LAST CALL", "", &moment<&Status::last_call>, Align::right, 6},
          {"CHANNELS", "", [](const Row& row) -> Cell { return channels_text(identity_of(row)); },
           Align::left, 5},
          {"UP", "", &moment<&Status::started>, Align::right, 6},
          {"UUID", "", [](const Row& row) -> Cell { return identity_of(row).uuid; }, Align::left,
           7},
          {"INSTANCE", "", [](const Row& row) -> Cell { return identity_of(row).id.to_string(); },
           Align::left, 9},
          {"DELIVERY", "",
           [](const Row& row) -> Cell { return std::string(name_of(identity_of(row).delivery)); },
           Align::left, 8},
          {"CERTIFICATE", "", [](const Row& row) -> Cell { return identity_of(row).certificate; },
           Align::left, 6},
          {"WAITING", "", &count<&Status::waiting>, Align::right, only_wide},
          {"REPEATED", "", &count<&Status::repeated>, Align::right, only_wide},
          {"CANCELLED", "", &count<&Status::cancelled>, Align::right, only_wide},
          {"DECLINED", "", &count<&Status::declined>, Align::right, only_wide},
          {"PROBLEM", "", &problem_of},
          {"", "answered",
           [](const Row& row) -> Cell {
             return row.was_asked ? Cell(row.answer.has_value()) : Cell();
           }},
          {"", "detail",
           [](const Row& row) -> Cell {
             return row.answer ? Cell(row.answer->outcome.detail.text) : Cell();
           }},
          {"", "alarms", &alarms_of}}
          .with_fields<fabric::InstanceIdentity>([](const Row& row) { return &identity_of(row); })
          .with_fields<Status>(&status_of);
  return instances;
}

}  // namespace millrace::tools::commands::look
