#include <algorithm>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"
#include "tools/doctor/look/look.hpp"

namespace millrace::tools::doctor::look {

namespace {

using base::text::safe;

/// Who says which service is called.
const char* where_the_uuid_stands(const std::string& machine) {
  return fabric::queue_of(machine).empty() ? "the program"
                                           : "the gateway's configuration (queue { uuid })";
}

bool is_told(const Findings& found, const std::string& machine) {
  return std::ranges::any_of(found.live.machines(),
                             [&](const auto& each) { return each.second.machine == machine; });
}

/// It waits, or is left alone, because its gateway takes no new call.
bool is_left_for_the_journal(const Findings& found, const fabric::ChannelStatus& status) {
  return status.state == fabric::ChannelState::unserved &&
         found.live.journal_trouble(fabric::machine_of(status.key.machine)) != nullptr;
}

/// It waits for an instance, and there is none.
bool has_no_instance(const Findings& found, const fabric::ChannelStatus& status) {
  return status.state == fabric::ChannelState::waiting &&
         found.live.takers(status.uuid, status.key) == 0;
}

/// What must be done before a retry helps.
std::string before_a_retry(const Findings& found, const fabric::ChannelStatus& status) {
  return found.live.takers(status.uuid, status.key) == 0
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
      report.problem(fmt::format("{} has no link: {}", channel, why), "see its gateway's log");
    } else if (is_left_for_the_journal(found, status)) {
      // The gateway says it itself: one cause, one diagnosis.
    } else if (status.state == unserved || has_no_instance(found, status)) {
      report.problem(
          fmt::format("{} waits for {}, which nobody serves: {}", channel, safe(status.uuid), why),
          fmt::format("start the service, or correct the UUID in {}",
                      where_the_uuid_stands(key.machine)));
    } else if (status.state == held) {
      report.problem(fmt::format("{} holds an at-most-once call: {}", channel, why),
                     fmt::format("millrace answer {} RESPONSE --state N, or millrace retry {}{}",
                                 channel, channel, before_a_retry(found, status)));
    } else if (status.state == waiting) {
      report.warning(fmt::format("{} waits for a free instance: {}", channel, why),
                     "start more instances; millrace stats shows how busy they are");
    }
  }
}

}  // namespace millrace::tools::doctor::look
