// What the call control hears of its channels: those of machines, and those that the gateway plays
// for message queues.
#include "gateway/core/core.hpp"

namespace millrace::gateway::core {

void Core::on_serve(const std::string& machine, const machines::Channels& channels) {
  queues_.on_up(machine, channels, *machines_.link_of(machine), now_);
  control_.on_link_up(machine, channels, now_);
}

void Core::on_lost(const std::string& machine, const std::string& reason) {
  control_.on_link_down(machine, reason, now_);
  queues_.on_down(machine, reason);
}

void Core::on_link_dropped(const std::string& machine, const std::string& reason) {
  control_.on_link_dropped(machine, reason, now_);
  queues_.on_link_gone(machine, reason);
}

void Core::on_retired(const fabric::ChannelKey& key) {
  control_.retire(key, now_);
  queues_.on_left(key.machine, key.channel, "the configuration names its channel no more");
}

void Core::on_refused(const fabric::ChannelKey& key, const std::string& reason) {
  control_.release(key, reason, now_);
  queues_.on_left(key.machine, key.channel, reason);
}

void Core::on_inherited(const fabric::ChannelStatus& status, const std::string& from) {
  control_.inherit(status.key, {status.uuid, from, status.call});
}

void Core::on_pushed(const fabric::ChannelKey& key, bool pushed) {
  control_.set_told(key, pushed, now_);
}

void Core::on_change(const fabric::ChannelKey& key, Variable variable) {
  control_.on_change(key, variable, now_);
}

machines::Channels Core::channels_of(const std::string& machine) const {
  return control_.channels_of(machine);
}

bool Core::tell_of_queues() {
  bool some = false;
  while (const auto event = queues_.next_event()) {
    some = true;
    const fabric::ChannelKey& key = event->key;
    switch (event->kind) {
      using enum MessageQueues::ChannelEvent::Kind;
      case opened:
        control_.on_link_up(key.machine, {key.channel}, now_);
        // Whatever changes there, we do.
        control_.set_told(key, true, now_);
        break;
      case down:
        control_.on_link_down(key.machine, event->reason, now_);
        break;
      case retired:
        control_.retire(key, now_);
        break;
      case read:
        on_queue_read(key, event->shown);
        break;
      case written:
        control_.on_write(key, WriteOutcome::written, "", now_);
        break;
      case changed:
        control_.on_change(key, Variable::request_state, now_);
        break;
    }
    queues_.on_event_told(*event);
  }
  return some;
}

void Core::on_queue_read(const fabric::ChannelKey& key, const Snapshot& snapshot) {
  control_.on_read(key, snapshot, now_);
}

}  // namespace millrace::gateway::core
