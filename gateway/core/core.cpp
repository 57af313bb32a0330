#include "gateway/core/core.hpp"

#include <cassert>
#include <utility>

#include <fmt/format.h>

namespace millrace::gateway::core {

namespace {

/// An answer that is half written when the gateway is to end.
constexpr std::chrono::seconds longest_end{2};

}  // namespace

Core::Core(Fabric& fabric, Host& host, CoreOptions options, const journal::Ledger& ledger)
    : fabric_(fabric),
      host_(host),
      options_(std::move(options)),
      ledger_(ledger),
      now_(host.now()),
      stall_(options_.lease),
      control_(*this,
               {.paces = settings::paces_of(options_.machines), .policies = options_.policies},
               ledger),
      queues_(fabric, host),
      machines_(options_.own, fabric, host, *this) {}

void Core::enter() {
  assert(!inside_);
  inside_ = true;
  now_ = host_.now();
  if (const auto late = stall_.late(now_.steady)) {
    if (machines_.stood_still(now_) || *late > options_.lease) {
      host_.say(Level::warn, fmt::format("this gateway stood still for {:.1f} s",
                                         std::chrono::duration<double>(*late).count()));
    }
  }
}

void Core::finish() {
  // What a queue's call has asked may end a channel, of which the machines are told, and so on.
  do {
    machines_.finish(now_);
  } while (tell_of_queues());
  machines_.ask_values(now_);
  if (ends_at_ && !may_end_ && (!control_.answering() || *ends_at_ <= now_.steady)) {
    may_end_ = true;
    host_.may_end(control_.answering());
  }
  if (const auto next = next_time(); next != wakes_at_) {
    wakes_at_ = next;
    host_.wake_at(next);
  }
  inside_ = false;
}

std::optional<SteadyTime> Core::next_time() const {
  std::optional<SteadyTime> first = may_end_ ? std::nullopt : ends_at_;
  for (const auto& one : {control_.next_time(), machines_.next_time(), queues_.next_time()}) {
    if (one && (!first || *one < *first)) {
      first = one;
    }
  }
  return first;
}

void Core::start() {
  enter();
  queues_.set(settings::queues_of(options_.machines), ledger_.queues(), now_);
  machines_.set(options_.machines, now_);
  finish();
}

void Core::change(std::vector<settings::MachineSettings> machines, Policies policies) {
  enter();
  options_.machines = std::move(machines);
  options_.policies = std::move(policies);
  control_.change(settings::paces_of(options_.machines), options_.policies, now_);
  queues_.set(settings::queues_of(options_.machines), ledger_.queues(), now_);
  machines_.set(options_.machines, now_);
  finish();
}

void Core::stop() {
  enter();
  ends_at_ = now_.steady + longest_end;
  control_.set_obstacle("the gateway is ending", now_);
  finish();
}

void Core::end() {
  enter();
  control_.take_back(now_);
  finish();
}

void Core::on_time() {
  enter();
  wakes_at_.reset();
  machines_.on_time(now_);
  queues_.on_time(now_);
  if (const auto next = control_.next_time(); next && *next <= now_.steady) {
    control_.on_time(now_);
  }
  finish();
}

SteadyTime Core::beat() {
  enter();
  finish();
  return stall_.beat(now_.steady);
}

void Core::tell_load() {
  enter();
  machines_.tell_load(now_);
  queues_.tell_numbers(now_);
  finish();
}

void Core::on_other_event() {
  enter();
  finish();
}

void Core::on_link_up(const std::string& machine, const machines::Channels& channels) {
  enter();
  machines_.on_link_up(machine, channels, now_);
  finish();
}

void Core::on_link_down(const std::string& machine, const std::string& reason) {
  enter();
  machines_.on_link_down(machine, reason, now_);
  finish();
}

void Core::on_read(const fabric::ChannelKey& key, const Snapshot& snapshot) {
  enter();
  if (machines_.linked(key.machine)) {
    // First, so that it is known when to look next.
    machines_.on_read(key, snapshot, now_);
    machines_.on_call_answered(key.machine, now_);
    control_.on_read(key, snapshot, now_);
  }
  finish();
}

void Core::on_read_failed(const fabric::ChannelKey& key, const std::string& reason) {
  enter();
  if (machines_.linked(key.machine)) {
    machines_.on_call_answered(key.machine, now_);
    control_.on_read_failed(key, reason, now_);
  }
  finish();
}

void Core::on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                    const std::string& reason) {
  enter();
  if (machines_.linked(key.machine)) {
    machines_.on_call_answered(key.machine, now_);
    control_.on_write(key, outcome, reason, now_);
  }
  finish();
}

void Core::on_watched(const std::string& machine,
                      const std::vector<machines::WatchOutcome>& outcomes) {
  enter();
  machines_.on_watched(machine, outcomes, now_);
  finish();
}

void Core::on_told(const fabric::ChannelKey& key, Variable variable,
                   std::optional<std::uint32_t> value) {
  enter();
  machines_.on_told(key, variable, value, now_);
  finish();
}

void Core::on_answer(const std::string& machine, const machines::Answer& answer) {
  enter();
  machines_.on_answer(machine, answer, now_);
  finish();
}

void Core::on_queue_answer(const fabric::ChannelKey& queue, queues::StepAnswer answer) {
  enter();
  queues_.on_answer(queue, std::move(answer), now_);
  finish();
}

void Core::on_queue_event(const fabric::ChannelKey& queue) {
  enter();
  queues_.on_change(queue, now_);
  finish();
}

void Core::on_variable_request(const fabric::VariableRequest& request) {
  enter();
  machines_.on_request(request, now_);
  finish();
}

void Core::on_recorded(const Ticket& ticket) {
  enter();
  if (ticket.owner == Ticket::Owner::queue) {
    queues_.on_recorded(ticket, now_);
  } else {
    control_.on_recorded(ticket, now_);
  }
  finish();
}

void Core::on_journal_trouble(const std::string& trouble) {
  enter();
  if (!ends_at_) {
    control_.set_journal_trouble(trouble, now_);
  }
  host_.notice({.kind = "journal"}, trouble,
               "make room on the disk, or give it its folder back; it goes on by itself");
  finish();
}

void Core::on_instance_ready(const fabric::InstanceIdentity& instance) {
  enter();
  control_.on_instance_ready(instance, now_);
  finish();
}

void Core::on_instance_gone(const fabric::InstanceId& instance) {
  enter();
  control_.on_instance_gone(instance, now_);
  finish();
}

void Core::on_load(const fabric::InstanceLoad& load) {
  enter();
  control_.on_load(load, now_);
  finish();
}

void Core::on_reply(const fabric::Reply& reply) {
  enter();
  control_.on_reply(reply, now_);
  finish();
}

void Core::set_interest(const Interest& interest) {
  enter();
  control_.set_interest(interest, now_);
  finish();
}

void Core::on_machine(const fabric::MachineStatus& status) {
  enter();
  machines_.on_machine(status, now_);
  finish();
}

void Core::on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway) {
  enter();
  machines_.on_machine_gone(machine, gateway, now_);
  finish();
}

void Core::on_channel(const fabric::ChannelStatus& status) {
  enter();
  machines_.on_channel(status, now_);
  finish();
}

control::Verdict Core::on_answer(const fabric::ChannelKey& key, const fabric::CallId& call,
                                 const control::OperatorAnswer& answer) {
  enter();
  control::Verdict verdict = control_.on_answer(key, call, answer, now_);
  finish();
  return verdict;
}

control::Verdict Core::on_retry(const fabric::ChannelKey& key, const fabric::CallId& call,
                                const std::string& by) {
  enter();
  control::Verdict verdict = control_.on_retry(key, call, by, now_);
  finish();
  return verdict;
}

}  // namespace millrace::gateway::core
