#include <map>
#include <set>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/doctor/look/look.hpp"

namespace millrace::tools::doctor::look {

namespace {

using base::text::safe;

void no_link(const fabric::MachineStatus& status, Report& report) {
  report.problem(fmt::format("{} has no link: {}", safe(status.machine), safe(status.reason)),
                 status.host.empty()
                     ? "start its gateway again"
                     : fmt::format("look at the controller at {} and at the gateway's log on {}",
                                   safe(status.address), safe(status.host)));
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
    } else if (!down.contains(status.machine) || !status.host.empty()) {
      // One that is gone says less than one that stands there.
      down[status.machine] = &status;
    }
  }
  for (const auto& [machine, status] : down) {
    if (!connected.contains(machine)) {
      no_link(*status, report);
    } else if (!status->host.empty()) {
      report.fine(fmt::format("another gateway of {} stands by on {}: {}", safe(machine),
                              safe(status->host), safe(status->reason)));
    }
  }
}

}  // namespace millrace::tools::doctor::look
