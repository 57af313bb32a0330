#include <chrono>
#include <map>
#include <set>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/doctor/look/look.hpp"

namespace millrace::tools::doctor::look {

namespace {

using base::text::safe;

void no_link(const fabric::MachineStatus& status, Report& report) {
  report.problem(fmt::format("{} has no link: {}", safe(status.machine), safe(status.reason)),
                 fmt::format("look at the controller at {} and at the gateway's log on {}",
                             safe(status.address), safe(status.host)));
}

void no_gateway(const bus::LostMachine& lost, Report& report) {
  const std::string where = safe(lost.last.host);
  report.problem(
      fmt::format("{}: its gateway has not reported since {:%F %T} UTC ({}, pid {})",
                  safe(lost.last.machine), std::chrono::floor<std::chrono::seconds>(lost.since),
                  where, lost.last.pid),
      fmt::format("restart the gateway on {}; pending calls wait and are not lost", where));
}

}  // namespace

void at_machines(const Findings& found, Report& report) {
  std::set<std::string> connected;
  std::map<std::string, const fabric::MachineStatus*> down;
  for (const auto& [key, status] : found.live.machines()) {
    if (status.connected) {
      connected.insert(status.machine);
      report.fine(fmt::format("{} is connected to its gateway on {}", safe(status.machine),
                              safe(status.host)));
    } else if (!status.host.empty()) {
      down[status.machine] = &status;
    }
  }
  for (const auto& [machine, status] : down) {
    if (!connected.contains(machine)) {
      no_link(*status, report);
    } else {
      report.fine(fmt::format("another gateway of {} stands by on {}: {}", safe(machine),
                              safe(status->host), safe(status->reason)));
    }
  }
  for (const bus::LostMachine& lost : lost_machines(found)) {
    no_gateway(lost, report);
  }
}

}  // namespace millrace::tools::doctor::look
