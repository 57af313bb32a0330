#include <algorithm>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"
#include "tools/doctor/checks/checks.hpp"

namespace millrace::tools::doctor::checks {

namespace {

using base::text::safe;

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
        report.problem(fmt::format("{} has a blocked at-most-once call: {}", channel, why),
                       fmt::format("millrace answer {} RESPONSE --state N, or millrace retry {}{}",
                                   channel, channel, before_a_retry(found, status)));
        break;
      case bus::Obstacle::busy:
      case bus::Obstacle::long_busy:
        report.warning(fmt::format("{} waits for a free instance: {}", channel, why),
                       "start more instances; millrace services shows how busy they are");
        break;
    }
  }
}

}  // namespace millrace::tools::doctor::checks
