#include <set>
#include <string>

#include "base/messages/catalogue.hpp"
#include "base/text/quoted.hpp"
#include "fabric/plant/assess.hpp"
#include "tools/doctor/checks/checks.hpp"

namespace millrace::tools::doctor::checks {

namespace {

namespace messages = base::messages;
using base::text::safe;

/// How a gateway connects to its controller, from the address that it publishes: "10.0.0.5:8016,
/// 10.0.0.5.1.1, Secure ADS".
void at_the_transport(const fabric::MachineStatus& status, Report& report) {
  const bool secure = status.address.ends_with(", Secure ADS");
  const std::string machine = safe(status.machine);
  const std::string host = safe(status.host);
  report.fine(status.address.empty() ? messages::connected_to_gateway(machine, host)
              : secure               ? messages::connected_secure_ads(machine, host)
                                     : messages::connected_plain_ads(machine, host));
  const bool same_host = status.address.starts_with("127.") ||
                         status.address.starts_with("localhost:") ||
                         status.address.starts_with("::1:");
  if (!status.address.empty() && !secure && !same_host) {
    report.warning(messages::plain_ads_readable(machine),
                   messages::configure_secure(machine, host));
  }
}

}  // namespace

void at_machines(const Findings& found, Report& report) {
  std::set<std::string> connected;
  for (const auto& [key, status] : found.live.machines()) {
    if (status.connected) {
      connected.insert(status.machine);
      at_the_transport(status, report);
    }
  }
  for (const auto& [key, status] : found.live.machines()) {
    if (!status.connected && !status.gone && connected.contains(status.machine)) {
      report.fine(
          messages::another_stands_by(safe(status.machine), safe(status.host), status.reason));
    }
  }
}

void at_concerns(const Findings& found, Report& report) {
  fabric::plant::Plant plant = found.live;
  for (const fabric::plant::LostMachine& lost : lost_machines(found)) {
    if (!plant.has_gateway(lost.last.machine)) {
      plant.add({.sample = lost.last});
      plant.add({.sample = fabric::MachineStatus{.machine = lost.last.machine,
                                                 .gateway = lost.last.gateway,
                                                 .since = lost.since,
                                                 .reason = lost.reason,
                                                 .gone = true}});
    }
  }
  for (const fabric::plant::Concern& concern :
       fabric::plant::assess(plant, found.joining.now, {.flags = found.joining.flags})) {
    // gateways_and_services() knows why there is no gateway.
    if (concern.kind != fabric::plant::Kind::no_gateway) {
      report.concern(concern);
    }
  }
}

}  // namespace millrace::tools::doctor::checks
