// How the changes in a machine's channels are found out: carries out what its watch decides.
#include <fmt/format.h>

#include "gateway/machines/machines.hpp"

namespace millrace::gateway::machines {

void Machines::carry_out(Machine& one, const WatchActions& actions) {
  if (one.link && !actions.unsubscribe.empty()) {
    one.link->unwatch(actions.unsubscribe);
  }
  if (one.link && !actions.subscribe.empty()) {
    one.link->watch(actions.subscribe);
  }
  for (const auto& [level, words] : actions.say) {
    io_.say(level, fmt::format("{}: {}", one.settings.to_string(), words));
  }
  if (actions.status && one.up && one.refusal.empty()) {
    one.report.on_up(one.served.size(), note_of(one), io_.now());
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

void Machines::on_read(const fabric::ChannelKey& key, const Snapshot& snapshot) {
  if (Machine* one = find_linked(key.machine)) {
    carry_out(*one, one->watch.on_looked(key.channel, snapshot, io_.now().steady));
  }
}

void Machines::on_watched(const std::string& machine, const std::vector<WatchOutcome>& outcomes) {
  if (Machine* one = find_linked(machine)) {
    carry_out(*one, one->watch.on_watched(outcomes, io_.now().steady));
  }
}

void Machines::on_told(const fabric::ChannelKey& key, Variable variable,
                       std::optional<std::uint32_t> value) {
  if (Machine* one = find_linked(key.machine)) {
    carry_out(*one, one->watch.on_told(key.channel, variable, value, io_.now().steady));
  }
}

std::string Machines::note_of(const Machine& one) {
  const std::string watched = one.watch.words();
  if (one.note.empty() || watched.empty()) {
    return one.note + watched;
  }
  return fmt::format("{}; {}", one.note, watched);
}

}  // namespace millrace::gateway::machines
