// What becomes of the channels of machines.
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

}  // namespace millrace::gateway::core
