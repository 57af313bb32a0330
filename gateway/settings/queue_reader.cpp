#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "fabric/channel_scope.hpp"
#include "fabric/messages.hpp"
#include "gateway/settings/readers.hpp"

namespace millrace::gateway::settings {

namespace {

using base::configuration::ConfigPath;
using base::configuration::ConfigStep;
using base::configuration::Mistakes;
using queues::QueueSettings;

constexpr int most_queues = 64;
constexpr std::uint32_t last_queue_channel = 255;

void check_symbol(const std::string& name, const ConfigPath& path, const char* example,
                  Mistakes& mistakes) {
  constexpr std::size_t longest = 200;
  const bool right =
      !name.empty() && name.size() <= longest &&
      std::ranges::all_of(name, [](char c) { return static_cast<unsigned char>(c) > ' '; });
  mistakes.expect(right, path,
                  fmt::format("\"{}\"; expected a symbol of the controller in 1 to {} characters, "
                              "without blanks, as in \"{}\"",
                              name, longest, example));
}

void check_channel(const config::Machine& machine, const config::Queue& queue,
                   const ConfigPath& path, Mistakes& mistakes) {
  if (mistakes.expect_range(queue.channel(), 1U, last_queue_channel, path)) {
    const bool served =
        machine.channel_size() == 0 ||
        std::ranges::find(machine.channel(), queue.channel()) != machine.channel().end();
    mistakes.expect(served, path,
                    fmt::format("{}; machine {} is served with other channels only",
                                queue.channel(), machine.name()));
  }
}

QueueSettings read_queue(const config::Machine& machine, const config::Queue& from,
                         const ConfigPath& path, Mistakes& mistakes) {
  const std::string owner = fabric::queue_owner(machine.name(), from.name());
  mistakes.expect(
      fabric::is_machine_name(from.name()) && owner.size() <= fabric::longest_machine_name,
      path / "name",
      fmt::format("the name of the queue \"{}\"; expected letters, digits, '_' and '-', "
                  "together with the machine's at most {}",
                  from.name(), fabric::longest_machine_name - 1));
  check_channel(machine, from, path / "channel", mistakes);
  QueueSettings to;
  to.name = from.name();
  to.channel = static_cast<std::uint16_t>(from.channel());
  to.array = from.array().empty() ? "SD." + from.name() : from.array();
  to.control = from.control();
  if (from.has_array()) {
    check_symbol(from.array(), path / "array", "SD.ALARMS", mistakes);
  }
  check_symbol(to.control, path / "control", "SD.CONTROL", mistakes);
  to.uuid = from.uuid();
  constexpr std::size_t longest_uuid = 127;
  mistakes.expect(
      !to.uuid.empty() && to.uuid.size() <= longest_uuid, path / "uuid",
      fmt::format("the queue {} has no uuid, or one of more than {} characters; expected "
                  "the UUID of the service that gets its messages",
                  from.name(), longest_uuid));
  to.acknowledge = from.drain() == config::Queue::WHEN_ANSWERED
                       ? queues::Acknowledge::when_answered
                       : queues::Acknowledge::when_journalled;
  mistakes.expect_range(from.period_ms(), 1U, 60'000U, path / "period_ms");
  to.period = std::chrono::milliseconds(from.period_ms());
  mistakes.expect_range(from.backlog(), 1U, 1'000'000U, path / "backlog");
  to.backlog = from.backlog();
  to.events = from.events();
  return to;
}

}  // namespace

std::vector<QueueSettings> read_queues(const config::Machine& from, const ConfigPath& path,
                                       Mistakes& mistakes) {
  std::vector<QueueSettings> all;
  std::set<fabric::ChannelKey> keys;
  std::set<std::string> arrays;
  mistakes.expect(from.queue_size() <= most_queues, path / ConfigStep{"queue", most_queues},
                  fmt::format("machine {} has {} queues; expected at most {}", from.name(),
                              from.queue_size(), most_queues));
  for (int i = 0; i < from.queue_size() && i < most_queues; ++i) {
    const ConfigPath place = path / ConfigStep{"queue", i};
    all.push_back(read_queue(from, from.queue(i), place, mistakes));
    const QueueSettings& one = all.back();
    mistakes.expect(
        keys.insert(one.key(from.name())).second, place / "name",
        fmt::format("two queues of channel {} are called \"{}\"; expected different names",
                    one.channel, one.name));
    mistakes.expect(arrays.insert(one.control).second, place / "control",
                    fmt::format("{} is read twice: each of two readers loses the messages that the "
                                "other one reads; expected one queue for it",
                                one.control));
  }
  return all;
}

}  // namespace millrace::gateway::settings
