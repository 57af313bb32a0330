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
    const config::Queue& queue = from.queue(i);
    const ConfigPath place = path / ConfigStep{"queue", i};
    mistakes.expect(
        fabric::queue_owner(from.name(), queue.name()).size() <= fabric::longest_machine_name,
        place / "name",
        fmt::format("\"{}\"; expected at most {} characters together with the machine's name",
                    queue.name(), fabric::longest_machine_name - 1));
    expect_served(from, queue.channel(), place / "channel", mistakes);
    all.push_back({.name = queue.name(),
                   .channel = static_cast<std::uint16_t>(queue.channel()),
                   .array = queue.array().empty() ? "SD." + queue.name() : queue.array(),
                   .control = queue.control(),
                   .uuid = queue.uuid(),
                   .acknowledge = queue.drain() == config::Queue::WHEN_ANSWERED
                                      ? queues::Acknowledge::when_answered
                                      : queues::Acknowledge::when_journalled,
                   .period = std::chrono::milliseconds(queue.period_ms()),
                   .backlog = queue.backlog(),
                   .events = queue.events()});
  }
  return all;
}

}  // namespace millrace::gateway::settings
