// What happens on machines and fabric, and what operators want: into the call control with it.
#include <string_view>

#include <fmt/format.h>

#include "gateway/live/gateway_impl.hpp"
#include "gateway/words.hpp"

namespace millrace::gateway::live {

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

void Gateway::Impl::on_link_up(const std::string& machine,
                               const std::vector<std::uint16_t>& channels) {
  data.on_up(machine, channels);
  variables.on_up(machine, channels);
  queues.on_up(machine, channels);
  carry_out(control.on_link_up(machine, channels, now()));
}

void Gateway::Impl::on_link_down(const std::string& machine, const std::string& reason) {
  carry_out(control.on_link_down(machine, reason, now()));
  data.on_down(machine);
  variables.on_down(machine, reason);
  queues.on_down(machine, reason);
}

void Gateway::Impl::on_link_dropped(const std::string& machine, const std::string& reason) {
  carry_out(control.on_link_dropped(machine, reason, now()));
  data.on_dropped(machine);
  variables.on_dropped(machine);
  queues.on_left(machine, 0, reason);
}

void Gateway::Impl::on_retired(const fabric::ChannelKey& key) {
  carry_out(control.retire(key, now()));
  data.on_over(key);
  variables.on_over(key);
  queues.on_left(key.machine, key.channel, "the configuration names its channel no more");
}

void Gateway::Impl::on_refused(const fabric::ChannelKey& key, const std::string& reason) {
  carry_out(control.release(key, reason, now()));
  data.on_over(key);
  variables.on_over(key);
  queues.on_left(key.machine, key.channel, reason);
}

void Gateway::Impl::on_inherited(const fabric::ChannelStatus& status, const std::string& from) {
  control.inherit(status.key, {status.uuid, from, status.call});
}

void Gateway::Impl::on_contested() {
  watch.watch_channels();
}

std::vector<std::uint16_t> Gateway::Impl::channels_of(const std::string& machine) const {
  return control.channels_of(machine);
}

void Gateway::Impl::on_machine_status(const fabric::MachineStatus& status) {
  if (const auto published = call_end.publish(status); !published) {
    log->debug("{}: a status is lost: {}", status.machine, published.error());
  }
}

void Gateway::Impl::on_machine_left(const fabric::MachineStatus& status) {
  call_end.let_go(status);
}

void Gateway::Impl::on_read(const fabric::ChannelKey& key, const Snapshot& snapshot) {
  carry_out(control.on_read(key, snapshot, now()));
}

void Gateway::Impl::on_read_failed(const fabric::ChannelKey& key, const std::string& reason) {
  carry_out(control.on_read_failed(key, reason, now()));
}

void Gateway::Impl::on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                             const std::string& reason) {
  carry_out(control.on_write(key, outcome, reason, now()));
}

void Gateway::Impl::on_pushed(const fabric::ChannelKey& key, bool pushed) {
  carry_out(control.set_told(key, pushed, now()));
}

void Gateway::Impl::on_change(const fabric::ChannelKey& key, Variable variable) {
  carry_out(control.on_change(key, variable, now()));
}

void Gateway::Impl::on_machine(const fabric::MachineStatus& status) {
  begin_event();
  machines.on_machine(status);
}

void Gateway::Impl::on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway) {
  begin_event();
  machines.on_machine_gone(machine, gateway);
}

void Gateway::Impl::on_channel(const fabric::ChannelStatus& status) {
  begin_event();
  machines.on_channel(status);
}

namespace {

/// "archiver on press-pc, pid 812"
std::string name_of(const fabric::InstanceIdentity& instance) {
  return fmt::format("{} on {}, pid {}", instance.name, instance.host, instance.pid);
}

}  // namespace

void Gateway::Impl::on_instance_ready(const fabric::InstanceIdentity& instance) {
  begin_event();
  if (instance_lines.admit(now().steady)) {
    log->info("instance {} of {} is ready: {}{}", instance.id.to_string(), instance.uuid,
              name_of(instance),
              instance.certificate.empty() ? "" : ", trusted as " + instance.certificate);
  }
  notice_service(instance);
  carry_out(control.on_instance_ready(instance, now()));
}

void Gateway::Impl::on_instance_changed(const fabric::InstanceIdentity& instance) {
  begin_event();
  if (instance_lines.admit(now().steady)) {
    log->info("instance {} of {} changed: {}{}", instance.id.to_string(), instance.uuid,
              name_of(instance), instance.draining ? ": it is draining" : "");
  }
  notice_service(instance);
  carry_out(control.on_instance_ready(instance, now()));
}

/// Nothing but the log is told if that fails: it is no trouble of the gateway.
void Gateway::Impl::notice_service(const fabric::InstanceIdentity& there) {
  if (lost_services.on_ready(there)) {
    static_cast<void>(notices.clear("service", there.uuid));
  }
}

void Gateway::Impl::notice_lost(const control::LostService& lost) {
  const fabric::InstanceIdentity& last = lost.last;
  static_cast<void>(notices.raise(
      {.key = {.kind = "service", .subject = lost.uuid},
       .level = fabric::NoticeLevel::warning,
       .text = fmt::format("{} ({}) has no instance: the last one, pid {} on {}, is gone without a "
                           "word",
                           last.name, lost.uuid, last.pid, last.host),
       .advice = fmt::format("restart {} on {}", last.name, last.host)}));
}

void Gateway::Impl::on_instance_gone(const fabric::InstanceId& instance) {
  begin_event();
  if (instance_lines.admit(now().steady)) {
    const fabric::InstanceIdentity* const known = lost_services.find(instance);
    log->info("instance {} is gone{}", instance.to_string(),
              known == nullptr ? "" : ": " + name_of(*known));
  }
  if (const auto lost = lost_services.on_gone(instance, now())) {
    notice_lost(*lost);
  }
  carry_out(control.on_instance_gone(instance, now()));
}

void Gateway::Impl::on_load(const fabric::InstanceLoad& load) {
  begin_event();
  carry_out(control.on_load(load, now()));
}

void Gateway::Impl::on_reply(const fabric::Reply& reply) {
  begin_event();
  carry_out(control.on_reply(reply, now()));
}

void Gateway::Impl::on_readers(bool of_channels, bool of_events) {
  begin_event();
  carry_out(control.set_interest({of_events, of_channels, least_of(log)}, now()));
}

void Gateway::Impl::on_ignored(const std::string& reason) {
  log->warn("{}", reason);
}

void Gateway::Impl::on_command(const fabric::Command& command) {
  begin_event();
  const bool of_ours = command.kind != fabric::CommandKind::drain && control.serves(command.key);
  const bool to_us = command.kind == fabric::CommandKind::ping && command.instance == own.id;
  if (!of_ours && !to_us) {
    return;
  }
  if (const fabric::Outcome* done = done_commands.find(command.id)) {
    // Said again, because the outcome was not heard.
    tell(*done);
    return;
  }
  const control::Verdict verdict = obey(command);
  const std::string line =
      fmt::format("{}: {} by {}: {}", to_us ? "this gateway" : command.key.to_string(),
                  word_for(command.kind), command.issuer, verdict.detail);
  if (command.kind == fabric::CommandKind::ping) {
    log->debug("{}", line);
  } else if (verdict.done) {
    log->info("{}", line);
  } else if (const auto first = complaints.note("command", command.issuer, line, now().steady)) {
    log->info("{}", *first);
  }
  const fabric::Outcome outcome{own.id, command.id, verdict.done, fit_reason(verdict.detail),
                                now().wall};
  if (command.kind != fabric::CommandKind::ping) {
    done_commands.note(outcome, now().steady);
  }
  tell(outcome);
}

void Gateway::Impl::tell(const fabric::Outcome& outcome) {
  if (const auto published = command_end.publish(outcome); !published) {
    log->warn("the outcome of a command cannot be told: {}", published.error());
  }
}

void Gateway::Impl::tell(const variables::News::Written& written) {
  tell(fabric::Outcome{own.id, written.token, written.done, written.detail, now().wall});
}

control::Verdict Gateway::Impl::obey(const fabric::Command& command) {
  control::Verdict verdict;
  if (command.kind == fabric::CommandKind::retry) {
    carry_out(control.on_retry(command.key, command.call, command.issuer, verdict, now()));
  } else if (command.kind == fabric::CommandKind::ping) {
    verdict = {true, control.serves(command.key) ? "serves it" : "is there"};
  } else {
    carry_out(control.on_answer(command.key, command.call,
                                {command.text, command.state, command.issuer}, verdict, now()));
  }
  return verdict;
}

}  // namespace millrace::gateway::live
