// How changes in a machine's channels are detected: performs what its Subscriptions decide.
#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "gateway/core/machines.hpp"

namespace millrace::gateway::core {

void Machines::apply(Machine& machine, const machines::SubscriptionActions& actions, Moment now) {
  const auto* const connected = machine.connected();
  if (connected != nullptr && !actions.unsubscribe.empty()) {
    connected->link->unsubscribe(actions.unsubscribe);
  }
  if (connected != nullptr && !actions.subscribe.empty()) {
    connected->link->subscribe(actions.subscribe);
  }
  for (const auto& [level, words] : actions.log) {
    host_.log(level, fmt::format("{}: {}", machine.settings.to_string(), words));
  }
  if (actions.status && connected != nullptr && connected->found && machine.refusal.empty()) {
    write_up(machine, connected->served.size(), now);
    publish(machine);
  }
  wake_at(machine.subscriptions.next_time());
  const std::string& name = machine.settings.name;
  for (const auto& [channel, trusted] : actions.trusted) {
    listener_.on_trusted({name, channel}, trusted);
  }
  for (const auto& [channel, variable] : actions.changed) {
    listener_.on_change({name, channel}, variable);
  }
}

void Machines::on_read(const fabric::ChannelKey& key, const ServiceSnapshot& snapshot, Moment now) {
  if (Machine* machine = find_linked(key.machine)) {
    apply(*machine, machine->subscriptions.on_read(key.channel, snapshot, now.steady), now);
  }
}

void Machines::on_subscribed(const std::string& machine,
                             const std::vector<machines::SubscribeOutcome>& outcomes, Moment now) {
  if (Machine* linked = find_linked(machine)) {
    apply(*linked, linked->subscriptions.on_subscribed(outcomes, now.steady), now);
  }
}

void Machines::on_notification(const fabric::ChannelKey& key, Variable variable,
                               std::optional<std::uint32_t> value, Moment now) {
  if (Machine* machine = find_linked(key.machine)) {
    apply(*machine,
          machine->subscriptions.on_notification(key.channel, variable, value, now.steady), now);
  }
}

void Machines::write_up(Machine& machine, std::size_t channels, Moment now) {
  const auto [mode, text] = machine.subscriptions.status();
  machine.status_writer.on_up(channels, mode,
                              machine.note.empty() ? text
                              : text.empty()       ? machine.note
                                                   : base::messages::and_also(machine.note, text),
                              now);
}

}  // namespace millrace::gateway::core
