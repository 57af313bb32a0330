#include "gateway/core/core.hpp"

#include <cassert>
#include <utility>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"

namespace millrace::gateway::core {

namespace {

/// How long the end of the gateway waits for a half-written response.
constexpr std::chrono::seconds longest_end{2};

}  // namespace

Core::Core(Fabric& fabric, Host& host, CoreOptions options,
           const journal::JournalState& journal_state)
    : host_(host),
      options_(std::move(options)),
      journal_state_(journal_state),
      now_(host.now()),
      input_{.stall = machines::StallDetector(options_.lease)},
      context_(fabric, host),
      admission_{.numbers = CallNumbers(journal_state.numbers())},
      queues_(fabric, host),
      machines_(options_.own, fabric, host, *this) {
  channels_.set(options_.machines);
  context_.blocked.resume(journal_state.blocked());
}

void Core::enter() {
  assert(!input_.at_work);
  input_.at_work = true;
  now_ = host_.now();
  if (const auto overdue = input_.stall.take_overdue(now_.steady)) {
    if (machines_.on_stall(now_) || *overdue > options_.lease) {
      host_.log(Level::warn, fmt::format("this gateway stood still for {:.1f} s",
                                         std::chrono::duration<double>(*overdue).count()));
    }
  }
}

void Core::finish() {
  remove_drained_channels();
  // An action of a queue's call may end a channel, which the machines must learn, and so on.
  do {
    machines_.finish(now_);
  } while (deliver_queue_events());
  machines_.ask_values(now_);
  if (ending_ && !ending_->announced &&
      (!channels_.answering() || ending_->at_latest <= now_.steady)) {
    ending_->announced = true;
    host_.may_end(channels_.answering());
  }
  if (const auto next = next_time(); next != input_.wakes_at) {
    input_.wakes_at = next;
    host_.wake_at(next);
  }
  input_.at_work = false;
}

std::optional<SteadyTime> Core::next_time() const {
  const auto ends_at =
      ending_ && !ending_->announced ? std::optional(ending_->at_latest) : std::nullopt;
  return earliest({ends_at, next_time_of_calls(), machines_.next_time(), queues_.next_time()});
}

void Core::start() {
  input([&] {
    for (const CallRecord& call : journal_state_.open_calls()) {
      open(call.key).resume(call, policy_of(call.key, fabric::canonical_uuid(call.request.uuid)));
    }
    queues_.set(options_.machines, journal_state_.queues(), now_);
    machines_.set_journal(options_.journal);
    machines_.set(options_.machines, now_);
  });
}

void Core::change(std::vector<settings::MachineSettings> machines, Policies policies) {
  input([&] {
    options_.machines = std::move(machines);
    options_.policies = std::move(policies);
    channels_.set(options_.machines);
    offer_again();
    queues_.set(options_.machines, journal_state_.queues(), now_);
    machines_.set(options_.machines, now_);
  });
}

void Core::stop() {
  input([&] {
    ending_ = {now_.steady + longest_end};
    admission_.stopped = base::messages::gateway_ending();
  });
}

void Core::end() {
  input([&] {
    step_all([&](channel::Channel& channel) { channel.shut_down(now_); });
    dispose(context_.answered.take_all());
  });
}

void Core::on_time() {
  input([&] {
    input_.wakes_at.reset();
    machines_.on_time(now_);
    queues_.on_time(now_);
    if (const auto next = next_time_of_calls(); next && *next <= now_.steady) {
      on_time_of_calls();
    }
  });
}

std::optional<SteadyTime> Core::next_time_of_calls() const {
  return earliest({dispatcher_.next_time(), context_.answered.next_time(), channels_.next_time()});
}

void Core::on_time_of_calls() {
  const std::size_t known = dispatcher_.known();
  apply(dispatcher_.on_time(now_.steady));
  if (dispatcher_.known() != known) {
    offer_again();
  }
  dispose(context_.answered.due(now_.steady));
  for (channel::Channel* const channel : channels_.take_due(now_.steady)) {
    channel->on_wake(now_);
    follow(*channel);
  }
}

SteadyTime Core::heartbeat() {
  input([] {});
  return input_.stall.heartbeat(now_.steady);
}

void Core::publish_load() {
  input([&] {
    machines_.publish_load(now_);
    queues_.publish_numbers(now_);
  });
}

void Core::on_other_event() {
  input([] {});
}

void Core::on_link_up(const std::string& machine, const machines::Channels& channels) {
  input([&] { machines_.on_link_up(machine, channels, now_); });
}

void Core::on_link_down(const std::string& machine, const machines::LinkLoss& loss) {
  input([&] { machines_.on_link_down(machine, loss, now_); });
}

void Core::on_read(const fabric::ChannelKey& key, const ServiceSnapshot& snapshot) {
  input([&] {
    if (machines_.linked(key.machine)) {
      // First, so that the time of the next read is known.
      machines_.on_read(key, snapshot, now_);
      machines_.on_call_answered(key.machine, now_);
      read_channel(key, snapshot);
    }
  });
}

void Core::on_read_failed(const fabric::ChannelKey& key, const fabric::Message& reason) {
  input([&] {
    if (machines_.linked(key.machine)) {
      machines_.on_call_answered(key.machine, now_);
      step(key, [&](channel::Channel& channel) { channel.on_read_failed(reason, now_); });
    }
  });
}

void Core::on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                    const fabric::Message& reason) {
  input([&] {
    if (machines_.linked(key.machine)) {
      machines_.on_call_answered(key.machine, now_);
      step(key, [&](channel::Channel& channel) { channel.on_write(outcome, reason, now_); });
    }
  });
}

void Core::on_subscribed(const std::string& machine,
                         const std::vector<machines::SubscribeOutcome>& outcomes) {
  input([&] { machines_.on_subscribed(machine, outcomes, now_); });
}

void Core::on_notification(const fabric::ChannelKey& key, Variable variable,
                           std::optional<std::uint32_t> value) {
  input([&] { machines_.on_notification(key, variable, value, now_); });
}

void Core::on_answer(const std::string& machine, const machines::Answer& answer) {
  input([&] { machines_.on_answer(machine, answer, now_); });
}

void Core::on_queue_answer(const fabric::ChannelKey& queue, queues::StepAnswer answer) {
  input([&] { queues_.on_answer(queue, std::move(answer), now_); });
}

void Core::on_queue_event(const fabric::ChannelKey& queue) {
  input([&] { queues_.on_change(queue, now_); });
}

void Core::on_variable_request(const fabric::VariableRequest& request) {
  input([&] { machines_.on_request(request, now_); });
}

void Core::on_recorded(const Ticket& ticket) {
  input([&] {
    switch (ticket.owner) {
      case Ticket::Owner::queue:
        queues_.on_recorded(ticket, now_);
        break;
      case Ticket::Owner::numbers:
        if (admission_.numbers.on_recorded()) {
          offer_again();
        }
        break;
      default:
        step(ticket.key,
             [&](channel::Channel& channel) { channel.on_recorded(ticket.number, now_); });
    }
  });
}

void Core::on_journal_error(const fabric::Message& error) {
  input([&] {
    if (!ending_) {
      context_.journal_error = error;
      step_all([&](channel::Channel& channel) { channel.republish_status(now_); });
      admission_.stopped = error;
      if (error.empty()) {
        offer_again();
      }
    }
    machines_.set_journal(error.empty() ? options_.journal : fabric::JournalState::not_writable);
    host_.set_alarm({.kind = "journal"}, error, base::messages::free_space());
  });
}

void Core::on_instance_ready(const fabric::InstanceIdentity& instance) {
  input([&] {
    apply(dispatcher_.on_instance_ready(instance));
    offer_again();
  });
}

void Core::on_instance_gone(const fabric::InstanceId& instance) {
  input([&] { apply(dispatcher_.on_instance_gone(instance, now_.steady)); });
}

void Core::on_load(const fabric::InstanceLoad& load) {
  input([&] { apply(dispatcher_.on_load(load, now_.steady)); });
}

void Core::on_reply(const fabric::Reply& reply) {
  input(
      [&] { step(reply.key, [&](channel::Channel& channel) { channel.on_reply(reply, now_); }); });
}

void Core::set_readers(const Readers& readers) {
  input([&] {
    const Readers before = std::exchange(context_.readers, readers);
    if (readers.statuses && !before.statuses) {
      step_all([&](channel::Channel& channel) { channel.republish_status(now_); });
    }
  });
}

void Core::on_machine(const fabric::MachineStatus& status) {
  input([&] { machines_.on_machine(status, now_); });
}

void Core::on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway) {
  input([&] { machines_.on_machine_gone(machine, gateway, now_); });
}

void Core::on_channel(const fabric::ChannelStatus& status) {
  input([&] { machines_.on_channel(status, now_); });
}

}  // namespace millrace::gateway::core
