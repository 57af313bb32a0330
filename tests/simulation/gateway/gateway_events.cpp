// What comes to a gateway: from instances, from other gateways, from its machines.
#include <utility>

#include <fmt/format.h>

#include "tests/simulation/gateway/gateway_process.hpp"

namespace millrace::tests::simulation {

using gateway::WriteOutcome;

void GatewayProcess::on_instance_ready(const fabric::InstanceIdentity& instance) {
  begin_event();
  note("sees instance " + instance.id.to_string().substr(0, 8));
  witness_.on_ready(instance);
  carry_out(control_->on_instance_ready(mistakes_.seen(instance), now()));
}

void GatewayProcess::on_instance_changed(const fabric::InstanceIdentity& instance) {
  begin_event();
  witness_.on_ready(instance);
  carry_out(control_->on_instance_ready(mistakes_.seen(instance), now()));
}

void GatewayProcess::on_instance_gone(const fabric::InstanceId& instance) {
  begin_event();
  note("loses instance " + instance.to_string().substr(0, 8));
  witness_.on_gone(instance);
  if (!mistakes_.makes(Bug::instance_loss_ignored)) {
    carry_out(control_->on_instance_gone(instance, now()));
  }
}

void GatewayProcess::on_reply(const fabric::Reply& reply) {
  begin_event();
  if (mistakes_.forgets(reply)) {
    witness_.on_reply(reply, [] {});
    return;
  }
  witness_.on_reply(
      reply, [&] { carry_out(control_->on_reply(mistakes_.heard(reply, witness_), now())); });
}

void GatewayProcess::on_load(const fabric::InstanceLoad& load) {
  begin_event();
  carry_out(control_->on_load(load, now()));
}

void GatewayProcess::on_stranger(const fabric::Reply& reply) {
  note("hears a stranger speak for instance " + reply.instance.to_string().substr(0, 8));
  if (mistakes_.makes(Bug::stranger_believed)) {
    on_reply(reply);
  }
}

void GatewayProcess::on_machine(const fabric::MachineStatus& status) {
  begin_event();
  if (!mistakes_.makes(Bug::claims_ignored)) {
    machines_->on_machine(status);
  }
}

void GatewayProcess::on_machine_gone(const std::string& machine,
                                     const fabric::InstanceId& gateway) {
  begin_event();
  note(fmt::format("loses another gateway of {}", machine));
  machines_->on_machine_gone(machine, gateway);
}

void GatewayProcess::on_channel(const fabric::ChannelStatus& status) {
  begin_event();
  witness_.on_heard(status);
  machines_->on_channel(status);
}

void GatewayProcess::on_link_up(const std::string& machine,
                                const std::vector<std::uint16_t>& channels) {
  served_no_more(machine);
  for (const std::uint16_t channel : channels) {
    served_.insert({machine, channel});
  }
  note(fmt::format("serves {} channels of {}", channels.size(), machine));
  queues_->on_up(machine, channels);
  carry_out(control_->on_link_up(machine, channels, now()));
}

void GatewayProcess::on_link_down(const std::string& machine, const std::string& reason) {
  served_no_more(machine);
  carry_out(control_->on_link_down(machine, reason, now()));
  queues_->on_down(machine, reason);
}

void GatewayProcess::on_link_dropped(const std::string& machine, const std::string& reason) {
  served_no_more(machine);
  note(fmt::format("drops its link to {}: {}", machine, reason));
  carry_out(control_->on_link_dropped(machine, reason, now()));
  queues_->on_left(machine, 0, reason);
}

void GatewayProcess::served_no_more(const std::string& machine) {
  std::erase_if(served_, [&](const Key& key) { return key.machine == machine; });
}

void GatewayProcess::on_retired(const Key& key) {
  served_.erase(key);
  if (mistakes_.makes(Bug::reload_drops_calls)) {
    carry_out(control_->release(key, "not in the configuration any more", now()));
  } else {
    carry_out(control_->retire(key, now()));
  }
  queues_->on_left(key.machine, key.channel, "the configuration names its channel no more");
}

void GatewayProcess::on_refused(const Key& key, const std::string& reason) {
  served_.erase(key);
  witness_.on_refused(key);
  carry_out(control_->release(key, reason, now()));
  queues_->on_left(key.machine, key.channel, reason);
}

void GatewayProcess::on_inherited(const fabric::ChannelStatus& status, const std::string& from) {
  note(fmt::format("inherits {} of {} from {}", status.call.to_string(), status.key.to_string(),
                   from));
  if (!mistakes_.makes(Bug::inheritance_forgotten)) {
    control_->inherit(status.key, {status.uuid, from, status.call});
  }
}

void GatewayProcess::on_machine_status(const fabric::MachineStatus& status) {
  fabric().talk().publish(*end(), status);
}

void GatewayProcess::on_machine_left(const fabric::MachineStatus& status) {
  fabric().talk().let_go(*end(), status.machine);
}

void GatewayProcess::on_contested() {
  fabric().talk().watch_channels(*end());
}

std::vector<std::uint16_t> GatewayProcess::channels_of(const std::string& machine) const {
  return control_->channels_of(machine);
}

void GatewayProcess::on_read(const Key& key, const gateway::Snapshot& snapshot) {
  history().add(Looked{plan_.number, key, snapshot, looked_from_});
  mistakes_.on_read(key, snapshot);
  carry_out(control_->on_read(key, mistakes_.taken_for(key, snapshot), now()));
}

void GatewayProcess::on_read_failed(const Key& key, const std::string& reason) {
  carry_out(control_->on_read_failed(key, reason, now()));
}

void GatewayProcess::on_pushed(const Key& key, bool pushed) {
  carry_out(control_->set_told(key, pushed, now()));
}

void GatewayProcess::on_change(const Key& key, gateway::Variable variable) {
  carry_out(control_->on_change(key, variable, now()));
}

void GatewayProcess::on_write(const Key& key, WriteOutcome outcome, const std::string& reason) {
  if (const auto again = mistakes_.again(key, outcome, reason)) {
    carry_out(key, *again);
    return;
  }
  mistakes_.on_write(key, outcome);
  carry_out(control_->on_write(key, outcome, reason, now()));
}

}  // namespace millrace::tests::simulation
