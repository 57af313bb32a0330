// What becomes of machines, and what they need.
#include "gateway/core/core.hpp"

namespace millrace::gateway::core {

std::unique_ptr<machines::Link> Core::connect(const settings::MachineSettings& machine) {
  return host_.connect(machine);
}

void Core::say(Level level, const std::string& text) {
  host_.say(level, text);
}

void Core::on_serve(const std::string& machine, const machines::Channels& channels) {
  values_.at(machine).on_up(channels, now_);
  queues_.on_up(machine, channels);
  control_.on_link_up(machine, channels, now_);
}

void Core::on_lost(const std::string& machine, const std::string& reason) {
  values_.at(machine).on_down(reason, now_);
  control_.on_link_down(machine, reason, now_);
  queues_.on_down(machine, reason);
}

void Core::on_link_dropped(const std::string& machine, const std::string& reason) {
  values_.at(machine).on_dropped(now_);
  control_.on_link_dropped(machine, reason, now_);
  queues_.on_left(machine, 0, reason);
}

void Core::on_retired(const fabric::ChannelKey& key) {
  values_.at(key.machine).on_over(key.channel, now_);
  control_.retire(key, now_);
  queues_.on_left(key.machine, key.channel, "the configuration names its channel no more");
}

void Core::on_refused(const fabric::ChannelKey& key, const std::string& reason) {
  values_.at(key.machine).on_over(key.channel, now_);
  control_.release(key, reason, now_);
  queues_.on_left(key.machine, key.channel, reason);
}

void Core::on_inherited(const fabric::ChannelStatus& status, const std::string& from) {
  control_.inherit(status.key, {status.uuid, from, status.call});
}

void Core::on_machine_status(const fabric::MachineStatus& status) {
  fabric_.publish(status);
}

void Core::on_machine_left(const fabric::MachineStatus& status) {
  values_.erase(status.machine);
  fabric_.dispose(status);
}

void Core::on_contested() {
  fabric_.watch_channels();
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
