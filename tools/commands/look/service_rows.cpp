#include "tools/commands/look/service_rows.hpp"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>

namespace millrace::tools::commands::look {

namespace {

struct Service {
  ServiceRow row{};
  std::set<std::string> names{};
  std::chrono::nanoseconds busy{};
  std::vector<std::string> problems{};
};

void add(Service& service, const bus::KnownInstance& instance) {
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

bool waits(bus::Obstacle obstacle) {
  return obstacle == bus::Obstacle::unserved || obstacle == bus::Obstacle::busy ||
         obstacle == bus::Obstacle::long_busy;
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

}  // namespace

std::vector<ServiceRow> service_rows(const bus::FabricModel& live, fabric::Time now) {
  std::map<std::string, Service> services;
  for (const bus::KnownInstance* instance : live.instances_of("")) {
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
    const bus::Obstacle obstacle = live.obstacle_of(status, now);
    if (!status.uuid.empty() && waits(obstacle)) {
      Service& service = services[fabric::canonical_uuid(status.uuid)];
      ++service.row.waiting;
      if (obstacle == bus::Obstacle::long_busy) {
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
      if (std::ranges::find(problems, alarm.text) == problems.end()) {
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

}  // namespace millrace::tools::commands::look
