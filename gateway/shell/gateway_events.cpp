// Events of the fabric, and commands of operators.
#include <string_view>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "base/text/cp1252.hpp"
#include "fabric/observer/entry.hpp"
#include "fabric/words.hpp"
#include "gateway/shell/gateway.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway::shell {

namespace {

std::string_view word_for(fabric::CommandKind kind) {
  switch (kind) {
    case fabric::CommandKind::answer:
      return "answer";
    case fabric::CommandKind::retry:
      return "retry";
    case fabric::CommandKind::drain:
      return "drain";
    case fabric::CommandKind::ping:
      return "ping";
  }
  return "command";
}

}  // namespace

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

namespace {

/// "archiver on press-pc, pid 812"
std::string name_of(const fabric::InstanceIdentity& instance) {
  return fmt::format("{} on {}, pid {}", instance.name, instance.host, instance.pid);
}

/// Bytes of a response that an alarm quotes.
constexpr std::size_t most_text_in_alarm = 127;

/// The services of this project begin the text of an error so (services/text/answer.hpp). Our
/// choice for all others: which of their states are errors is not known here.
bool is_error(const fabric::Reply& reply) {
  return fabric::observer::is_failure(reply) || reply.text.starts_with("ERROR");
}

}  // namespace

void Gateway::on_instance_ready(const fabric::InstanceIdentity& instance) {
  if (instance_lines_.admit(now().steady)) {
    log_->info("instance {} of {} is ready: {}{}", instance.id.to_string(), instance.uuid,
               name_of(instance),
               instance.certificate.empty() ? "" : ", trusted as " + instance.certificate);
  }
  alarm_service(instance);
  core_.on_instance_ready(instance);
}

void Gateway::on_instance_changed(const fabric::InstanceIdentity& instance) {
  if (instance_lines_.admit(now().steady)) {
    log_->info("instance {} of {} changed: {}{}", instance.id.to_string(), instance.uuid,
               name_of(instance), instance.draining ? ": it is draining" : "");
  }
  alarm_service(instance);
  core_.on_instance_ready(instance);
}

/// A failure is only logged: it is not a fault of the gateway.
void Gateway::alarm_service(const fabric::InstanceIdentity& there) {
  if (lost_services_.on_ready(there)) {
    static_cast<void>(alarms_.clear("service", there.uuid));
  }
}

void Gateway::notice_lost(const core::LostService& lost) {
  const fabric::InstanceIdentity& last = lost.last;
  static_cast<void>(alarms_.raise(
      {.key = {.kind = "service", .subject = lost.uuid},
       .level = fabric::AlarmLevel::warning,
       .text = base::messages::service_without_instance(last.name, lost.uuid, last.pid, last.host),
       .advice = base::messages::restart_service(last.name, last.host)}));
}

void Gateway::on_instance_gone(const fabric::InstanceId& instance) {
  if (instance_lines_.admit(now().steady)) {
    const fabric::InstanceIdentity* const known = lost_services_.find(instance);
    log_->info("instance {} is gone{}", instance.to_string(),
               known == nullptr ? "" : ": " + name_of(*known));
  }
  if (const auto lost = lost_services_.on_gone(instance, now())) {
    notice_lost(*lost);
  }
  core_.on_instance_gone(instance);
}

void Gateway::on_load(const fabric::InstanceLoad& load) {
  core_.on_load(load);
}

void Gateway::on_reply(const fabric::Reply& reply) {
  core_.on_reply(reply);
  if (reply.kind == fabric::ReplyKind::final) {
    note_response(reply);
  }
}

void Gateway::note_response(const fabric::Reply& reply) {
  const bool is_bad = is_error(reply);
  if (!is_bad && error_series_.empty()) {
    return;
  }
  const fabric::InstanceIdentity* const by = lost_services_.find(reply.instance);
  if (by == nullptr || !core_.serves(reply.key)) {
    return;
  }
  if (!is_bad) {
    if (error_series_.on_success(by->uuid)) {
      static_cast<void>(alarms_.clear("errors", by->uuid));
    }
  } else if (const auto level = error_series_.on_error(by->uuid, now().steady)) {
    static_cast<void>(
        alarms_.raise({.key = {.kind = "errors", .subject = by->uuid},
                       .level = *level,
                       .text = base::messages::responses_are_errors(
                           error_series_.length(by->uuid), by->name,
                           fabric::shortened(base::text::to_utf8(reply.text), most_text_in_alarm)),
                       .advice = base::messages::check_service()}));
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
  const bool to_us = command.kind == fabric::CommandKind::ping && command.instance == own_.id;
  if (!of_ours && !to_us) {
    return;
  }
  if (const fabric::Outcome* done = command_history_.find(command.id)) {
    // Published again, because the tool did not receive the outcome.
    publish(*done);
    return;
  }
  const core::CommandResult result = execute(command);
  const std::string line =
      fmt::format("{}: {} by {}: {}", to_us ? "this gateway" : command.key.to_string(),
                  word_for(command.kind), command.issuer, result.detail);
  if (command.kind == fabric::CommandKind::ping) {
    log_->debug("{}", line);
  } else if (result.done) {
    log_->info("{}", line);
  } else if (const auto first = log_limiter_.admit("command", command.issuer, line, now().steady)) {
    log_->info("{}", *first);
  }
  const fabric::Outcome outcome{own_.id, command.id, result.done, result.detail, now().wall};
  if (command.kind != fabric::CommandKind::ping) {
    command_history_.add(outcome, now().steady);
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
