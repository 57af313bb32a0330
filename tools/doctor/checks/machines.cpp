#include <algorithm>
#include <chrono>
#include <map>
#include <set>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"
#include "tools/doctor/checks/checks.hpp"

namespace millrace::tools::doctor::checks {

namespace {

using base::text::safe;

void no_link(const fabric::MachineStatus& status, Report& report) {
  report.problem(fmt::format("{} has no connection: {}", safe(status.machine), safe(status.reason)),
                 fmt::format("check the controller at {} and the gateway's log on {}",
                             safe(status.address), safe(status.host)));
}

/// How a gateway connects to its controller, from the address that it publishes: "10.0.0.5:8016,
/// 10.0.0.5.1.1, Secure ADS".
void at_the_transport(const fabric::MachineStatus& status, Report& report) {
  const bool secure = status.address.ends_with(", Secure ADS");
  report.fine(fmt::format("{} is connected to its gateway on {}{}", safe(status.machine),
                          safe(status.host),
                          status.address.empty() ? ""
                          : secure               ? " over Secure ADS"
                                                 : " over plain ADS"));
  const bool same_host = status.address.starts_with("127.") ||
                         status.address.starts_with("localhost:") ||
                         status.address.starts_with("::1:");
  if (!status.address.empty() && !secure && !same_host) {
    report.warning(fmt::format("{} is connected over plain ADS: any host on its network can read "
                               "and change the traffic",
                               safe(status.machine)),
                   fmt::format("configure `secure` for {} in gateway.textproto on {} "
                               "(docs/how-to/secure-ads.md)",
                               safe(status.machine), safe(status.host)));
  }
}

std::string after_a_restart(fabric::JournalState journal, const std::string& host) {
  switch (journal) {
    case fabric::JournalState::kept:
      return fmt::format("restart the gateway on {}; pending calls wait and are not lost", host);
    case fabric::JournalState::none:
      return fmt::format(
          "restart the gateway on {}; it kept no journal: calls under way may run "
          "twice or be lost",
          host);
    default:
      return fmt::format("restart the gateway on {}", host);
  }
}

void no_gateway(const bus::LostMachine& lost, Report& report) {
  const std::string where = safe(lost.last.host);
  report.problem(
      fmt::format("{}: its gateway has not reported since {:%F %T} UTC ({}, pid {})",
                  safe(lost.last.machine), std::chrono::floor<std::chrono::seconds>(lost.since),
                  where, lost.last.pid),
      after_a_restart(lost.last.journal, where));
}

/// The place that names the service.
const char* where_the_uuid_stands(const std::string& machine) {
  return fabric::queue_of(machine).empty() ? "the program"
                                           : "the gateway's configuration (queue { uuid })";
}

bool is_told(const Findings& found, const std::string& machine) {
  return std::ranges::any_of(found.live.machines(),
                             [&](const auto& each) { return each.second.machine == machine; });
}

/// The necessary steps before a retry.
std::string before_a_retry(const Findings& found, const fabric::ChannelStatus& status) {
  return found.live.instances_for(status.uuid, status.key) == 0
             ? "; its service has no running instance: start it before you retry"
             : "";
}

}  // namespace

void at_machines(const Findings& found, Report& report) {
  std::set<std::string> connected;
  std::map<std::string, const fabric::MachineStatus*> down;
  for (const auto& [key, status] : found.live.machines()) {
    if (status.connected) {
      connected.insert(status.machine);
      at_the_transport(status, report);
    } else if (!status.gone) {
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

void at_channels(const Findings& found, Report& report) {
  using enum fabric::ChannelState;
  for (const auto& [key, status] : found.live.channels()) {
    const std::string channel = safe(key.to_string());
    const std::string why = safe(status.reason);
    if (status.state == link_down &&
        !is_told(found, std::string(fabric::machine_of(key.machine)))) {
      report.problem(fmt::format("{} has no connection: {}", channel, why),
                     "see its gateway's log");
    }
    switch (found.live.obstacle_of(status, found.joining.now)) {
      case bus::Obstacle::none:
      case bus::Obstacle::journal:  // its gateway says it itself: one cause, one diagnosis
        break;
      case bus::Obstacle::unserved:
        report.problem(fmt::format("{} waits for {}, and no service has this UUID: {}", channel,
                                   safe(status.uuid), why),
                       fmt::format("start the service, or correct the UUID in {}",
                                   where_the_uuid_stands(key.machine)));
        break;
      case bus::Obstacle::held:
        report.problem(
            fmt::format("{} has a blocked at-most-once call: {}", channel, why),
            fmt::format("millrace answer {0}{1} RESPONSE --state N, or millrace retry {0}{1}{2}",
                        base::text::shell_word(channel), found.joining.flags,
                        before_a_retry(found, status)));
        break;
      case bus::Obstacle::busy:
      case bus::Obstacle::long_busy:
        report.warning(fmt::format("{} waits for a free instance: {}", channel, why),
                       fmt::format("start more instances; {} shows how busy they are",
                                   fmt::format("millrace {}{}", "services", found.joining.flags)));
        break;
    }
  }
}

}  // namespace millrace::tools::doctor::checks
