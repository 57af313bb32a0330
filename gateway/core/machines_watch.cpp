// How the changes in a machine's channels are found out: carries out what its watch decides.
#include <fmt/format.h>

#include "gateway/core/machines.hpp"

namespace millrace::gateway::core {

void Machines::carry_out(Machine& one, const machines::WatchActions& actions, Moment now) {
  const auto* const connected = one.connected();
  if (connected != nullptr && !actions.unsubscribe.empty()) {
    connected->link->unwatch(actions.unsubscribe);
  }
  if (connected != nullptr && !actions.subscribe.empty()) {
    connected->link->watch(actions.subscribe);
  }
  for (const auto& [level, words] : actions.say) {
    host_.say(level, fmt::format("{}: {}", one.settings.to_string(), words));
  }
  if (actions.status && connected != nullptr && connected->found && one.refusal.empty()) {
    one.report.on_up(connected->served.size(), note_of(one), now);
    publish(one);
  }
  wake_at(one.watch.next_time());
  const std::string& name = one.settings.name;
  for (const auto& [channel, pushed] : actions.told) {
    listener_.on_pushed({name, channel}, pushed);
  }
  for (const auto& [channel, variable] : actions.look) {
    listener_.on_change({name, channel}, variable);
  }
}

void Machines::on_read(const fabric::ChannelKey& key, const Snapshot& snapshot, Moment now) {
  if (Machine* one = find_linked(key.machine)) {
    carry_out(*one, one->watch.on_looked(key.channel, snapshot, now.steady), now);
  }
}

void Machines::on_watched(const std::string& machine,
                          const std::vector<machines::WatchOutcome>& outcomes, Moment now) {
  if (Machine* one = find_linked(machine)) {
    carry_out(*one, one->watch.on_watched(outcomes, now.steady), now);
  }
}

void Machines::on_told(const fabric::ChannelKey& key, Variable variable,
                       std::optional<std::uint32_t> value, Moment now) {
  if (Machine* one = find_linked(key.machine)) {
    carry_out(*one, one->watch.on_told(key.channel, variable, value, now.steady), now);
  }
}

std::string Machines::note_of(const Machine& one) {
  const std::string watched = one.watch.words();
  if (one.note.empty() || watched.empty()) {
    return one.note + watched;
  }
  return fmt::format("{}; {}", one.note, watched);
}

}  // namespace millrace::gateway::core
