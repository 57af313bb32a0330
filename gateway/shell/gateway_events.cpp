// Events of the fabric, and commands of operators.
#include <fmt/format.h>

#include "fabric/words.hpp"
#include "gateway/shell/gateway.hpp"

namespace millrace::gateway::shell {

void Gateway::on_machine(const fabric::MachineStatus& status) {
  core_.on_machine(status);
}

void Gateway::on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway,
                              fabric::endpoints::Absence /*absence*/) {
  core_.on_machine_gone(machine, gateway);
}

void Gateway::on_channel(const fabric::ChannelStatus& status) {
  core_.on_channel(status);
}

void Gateway::on_instance_ready(const fabric::InstanceIdentity& instance) {
  alarms_.on_ready(instance, true, now());
  core_.on_instance_ready(instance);
}

void Gateway::on_instance_changed(const fabric::InstanceIdentity& instance) {
  alarms_.on_ready(instance, false, now());
  core_.on_instance_ready(instance);
}

void Gateway::on_instance_gone(const fabric::InstanceId& instance) {
  alarms_.on_gone(instance, now());
  core_.on_instance_gone(instance);
}

void Gateway::on_load(const fabric::InstanceLoad& load) {
  core_.on_load(load);
}

void Gateway::on_reply(const fabric::Reply& reply) {
  core_.on_reply(reply);
  if (reply.kind == fabric::ReplyKind::final && core_.serves(reply.key)) {
    alarms_.on_response(reply, now());
  }
}

void Gateway::on_readers(bool of_channels, bool of_events) {
  core_.set_readers({of_events, of_channels, min_level_of(log_)});
}

void Gateway::on_ignored(const std::string& reason) {
  log_->warn("{}", reason);
}

void Gateway::on_command(const fabric::Command& command) {
  const bool of_ours = command.kind != fabric::CommandKind::drain && core_.serves(command.key);
  const bool to_us =
      command.kind == fabric::CommandKind::ping && command.instance == fabric_.own.id;
  if (!of_ours && !to_us) {
    return;
  }
  if (const fabric::Outcome* done = fabric_.command_history.find(command.id)) {
    // Published again, because the tool did not receive the outcome.
    publish(*done);
    return;
  }
  const core::CommandResult result = execute(command);
  const std::string line =
      fmt::format("{}: {} by {}: {}", to_us ? "this gateway" : command.key.to_string(),
                  fabric::name_of(command.kind), command.issuer, result.detail);
  if (command.kind == fabric::CommandKind::ping) {
    log_->debug("{}", line);
  } else if (result.done) {
    log_->info("{}", line);
  } else if (const auto first = log_limiter_.admit("command", command.issuer, line, now().steady)) {
    log_->info("{}", *first);
  }
  const fabric::Outcome outcome{fabric_.own.id, command.id, result.done, result.detail, now().wall};
  if (command.kind != fabric::CommandKind::ping) {
    fabric_.command_history.add(outcome, now().steady);
  }
  publish(outcome);
}

core::CommandResult Gateway::execute(const fabric::Command& command) {
  switch (command.kind) {
    case fabric::CommandKind::retry:
      return core_.on_retry(command.key, command.call, command.issuer);
    case fabric::CommandKind::answer:
      return core_.on_answer(command.key, command.call,
                             {command.text, command.state, command.issuer});
    case fabric::CommandKind::ping:
    case fabric::CommandKind::drain:
      return {true, core_.serves(command.key) ? "serves it" : "is there"};
  }
  return {false,
          fmt::format("the gateway does not know this command: {}", fabric::name_of(command.kind))};
}

}  // namespace millrace::gateway::shell
