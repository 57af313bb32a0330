// How changes in a machine's channels are detected: performs what its Subscriptions decide.
#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "gateway/core/machines.hpp"

namespace millrace::gateway::core {

void Machines::apply(Machine& one, const machines::SubscriptionActions& actions, Moment now) {
  const auto* const connected = one.connected();
  if (connected != nullptr && !actions.unsubscribe.empty()) {
    connected->link->unsubscribe(actions.unsubscribe);
  }
  if (connected != nullptr && !actions.subscribe.empty()) {
    connected->link->subscribe(actions.subscribe);
  }
  for (const auto& [level, words] : actions.log) {
    host_.log(level, fmt::format("{}: {}", one.settings.to_string(), words));
  }
  if (actions.status && connected != nullptr && connected->found && one.refusal.empty()) {
    write_up(one, connected->served.size(), now);
    publish(one);
  }
  wake_at(one.subscriptions.next_time());
  const std::string& name = one.settings.name;
  for (const auto& [channel, trusted] : actions.trusted) {
    listener_.on_trusted({name, channel}, trusted);
  }
  for (const auto& [channel, variable] : actions.changed) {
    listener_.on_change({name, channel}, variable);
  }
}

void Machines::on_read(const fabric::ChannelKey& key, const ServiceSnapshot& snapshot, Moment now) {
  if (Machine* one = find_linked(key.machine)) {
    apply(*one, one->subscriptions.on_read(key.channel, snapshot, now.steady), now);
  }
}

void Machines::on_subscribed(const std::string& machine,
                             const std::vector<machines::SubscribeOutcome>& outcomes, Moment now) {
  if (Machine* one = find_linked(machine)) {
    apply(*one, one->subscriptions.on_subscribed(outcomes, now.steady), now);
  }
}

void Machines::on_notification(const fabric::ChannelKey& key, Variable variable,
                               std::optional<std::uint32_t> value, Moment now) {
  if (Machine* one = find_linked(key.machine)) {
    apply(*one, one->subscriptions.on_notification(key.channel, variable, value, now.steady), now);
  }
}

void Machines::write_up(Machine& one, std::size_t channels, Moment now) {
  const auto [mode, text] = one.subscriptions.status();
  one.status_writer.on_up(channels, mode,
                          one.note.empty() ? text
                          : text.empty()   ? one.note
                                           : base::messages::and_also(one.note, text),
                          now);
}

}  // namespace millrace::gateway::core
