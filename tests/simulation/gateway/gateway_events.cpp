// The inputs of a gateway: from instances, from other gateways, over its links.
#include <utility>

#include <fmt/format.h>

#include "tests/simulation/gateway/gateway_process.hpp"

namespace millrace::tests::simulation {

using gateway::WriteOutcome;

void GatewayProcess::on_instance_ready(const fabric::InstanceIdentity& instance) {
  note("sees instance " + instance.id.to_string().substr(0, 8));
  checker_.on_ready(instance);
  core_->on_instance_ready(mistakes_.seen(instance));
}

void GatewayProcess::on_instance_changed(const fabric::InstanceIdentity& instance) {
  checker_.on_ready(instance);
  core_->on_instance_ready(mistakes_.seen(instance));
}

void GatewayProcess::on_instance_gone(const fabric::InstanceId& instance) {
  note("loses instance " + instance.to_string().substr(0, 8));
  checker_.on_gone(instance);
  if (!mistakes_.makes(Bug::instance_loss_ignored)) {
    core_->on_instance_gone(instance);
  }
}

void GatewayProcess::on_reply(const fabric::Reply& reply) {
  if (mistakes_.forgets(reply)) {
    checker_.on_reply(reply, [] {});
    return;
  }
  checker_.on_reply(reply, [&] { core_->on_reply(mistakes_.heard(reply, checker_)); });
}

void GatewayProcess::on_load(const fabric::InstanceLoad& load) {
  core_->on_load(load);
}

void GatewayProcess::on_stranger(const fabric::Reply& reply) {
  note("hears a stranger speak for instance " + reply.instance.to_string().substr(0, 8));
  if (mistakes_.makes(Bug::stranger_believed)) {
    on_reply(reply);
  }
}

void GatewayProcess::on_machine(const fabric::MachineStatus& status) {
  if (!mistakes_.makes(Bug::claims_ignored)) {
    core_->on_machine(status);
  }
}

void GatewayProcess::on_machine_gone(const std::string& machine,
                                     const fabric::InstanceId& gateway) {
  note(fmt::format("loses another gateway of {}", machine));
  core_->on_machine_gone(machine, gateway);
}

void GatewayProcess::on_channel(const fabric::ChannelStatus& status) {
  checker_.on_heard(status);
  if (!mistakes_.makes(Bug::inheritance_forgotten)) {
    core_->on_channel(status);
  }
}

std::shared_ptr<AdsLink> GatewayProcess::link_to(const std::string& machine) const {
  const auto found = links_.find(machine);
  auto link = found == links_.end() ? nullptr : found->second.lock();
  return link && !link->abandoned() ? link : nullptr;
}

void GatewayProcess::on_link_up(const std::string& machine,
                                const std::vector<std::uint16_t>& channels) {
  core_->on_link_up(machine, channels);
}

void GatewayProcess::on_link_down(const std::string& machine, const std::string& reason) {
  core_->on_link_down(machine, reason);
}

void GatewayProcess::on_read(const Key& key, const gateway::ServiceSnapshot& snapshot) {
  // A gateway that stood still may remove the link before it handles what was read.
  core_->on_other_event();
  if (link_to(key.machine)) {
    history().add(SnapshotRead{plan_.number, key, snapshot, looked_from_});
    mistakes_.on_read(key, snapshot);
    core_->on_read(key, mistakes_.taken_for(key, snapshot));
  }
}

void GatewayProcess::on_read_failed(const Key& key, const std::string& reason) {
  core_->on_read_failed(key, reason);
}

void GatewayProcess::on_write(const Key& key, WriteOutcome outcome, const std::string& reason) {
  core_->on_other_event();
  const auto link = link_to(key.machine);
  if (const auto again = link ? mistakes_.again(key, outcome, reason) : std::nullopt) {
    checker_.on_write(key, again->variable, again->value);
    link->write(key.channel, again->variable, again->value);
    return;
  }
  mistakes_.on_write(key, outcome);
  core_->on_write(key, outcome, reason);
}

void GatewayProcess::on_subscribed(
    const std::string& machine, const std::vector<gateway::machines::SubscribeOutcome>& outcomes) {
  core_->on_subscribed(machine, outcomes);
}

void GatewayProcess::on_notification(const Key& key, gateway::Variable variable,
                                     std::optional<std::uint32_t> value) {
  core_->on_notification(key, variable, value);
}

void GatewayProcess::ask(const fabric::VariableRequest& request) {
  core_->on_variable_request(request);
}

void GatewayProcess::on_answer(const std::string& machine,
                               const gateway::machines::Answer& answer) {
  core_->on_answer(machine, answer);
}

void GatewayProcess::on_queue_answer(const Key& queue, gateway::queues::StepAnswer answer) {
  core_->on_queue_answer(queue, std::move(answer));
}

void GatewayProcess::on_queue_event(const Key& queue) {
  core_->on_queue_event(queue);
}

}  // namespace millrace::tests::simulation
