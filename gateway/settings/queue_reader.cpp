#include <fmt/format.h>

#include "fabric/channel_scope.hpp"
#include "gateway/settings/readers.hpp"

namespace millrace::gateway::settings {

using base::configuration::ConfigPath;
using base::configuration::ConfigStep;
using base::configuration::Mistakes;

std::vector<queues::QueueSettings> read_queues(const config::Machine& from, const ConfigPath& path,
                                               Mistakes& mistakes) {
  std::vector<queues::QueueSettings> all;
  for (int i = 0; i < from.queue_size(); ++i) {
    const config::Queue& one = from.queue(i);
    const ConfigPath place = path / ConfigStep{"queue", i};
    mistakes.expect(
        fabric::queue_owner(from.name(), one.name()).size() <= fabric::longest_machine_name,
        place / "name",
        fmt::format("\"{}\"; expected at most {} characters together with the machine's name",
                    one.name(), fabric::longest_machine_name - 1));
    expect_served(from, one.channel(), place / "channel", mistakes);
    all.push_back({.name = one.name(),
                   .channel = static_cast<std::uint16_t>(one.channel()),
                   .array = one.array().empty() ? "SD." + one.name() : one.array(),
                   .control = one.control(),
                   .uuid = one.uuid(),
                   .acknowledge = one.drain() == config::Queue::WHEN_ANSWERED
                                      ? queues::Acknowledge::when_answered
                                      : queues::Acknowledge::when_journalled,
                   .period = std::chrono::milliseconds(one.period_ms()),
                   .backlog = one.backlog(),
                   .events = one.events()});
  }
  return all;
}

}  // namespace millrace::gateway::settings
