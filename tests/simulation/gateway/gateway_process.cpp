#include "tests/simulation/gateway/gateway_process.hpp"

#include <utility>

#include <fmt/format.h>

namespace millrace::tests::simulation {
namespace journal = gateway::journal;
using gateway::WriteOutcome;

namespace {

/// Eight heartbeats in its lease of half a second, and at most two seconds to end.
constexpr unsigned most_heartbeats_to_end = 64;

/// All that a gateway knows when it starts, except times.
std::string words_for(const journal::JournalState& journal_state) {
  std::string words =
      fmt::format("{} {}", journal_state.numbers().epoch, journal_state.numbers().reserved);
  for (const gateway::CallRecord& call : journal_state.open_calls()) {
    words += fmt::format(" {} {} {} {} {} {}", call.id.to_string(), call.request.text,
                         call.request.state, static_cast<int>(call.delivery), call.clearing,
                         fmt::join(call.shown, ","));
    for (const gateway::Attempt& attempt : call.attempts) {
      words += fmt::format(" {}:{}", attempt.number, attempt.instance.to_string());
    }
    if (call.answer) {
      words +=
          fmt::format(" {} {} {}", call.answer->text, call.answer->state, call.answer->attempt);
    }
  }
  return words;
}

}  // namespace

GatewayProcess::GatewayProcess(GatewayPlan plan, Agenda& agenda, Party party, History& history,
                               simulation::Fabric& fabric, Random random)
    : Member(fmt::format("gateway {}", plan.number), agenda, party, history, fabric),
      plan_(std::move(plan)),
      random_(random),
      disk_(process(), random_.fork(), plan_.bug),
      checker_(plan_.number, history),
      mistakes_(plan_.bug) {
  disk_.on_recorded = [this](const gateway::Ticket& ticket) { on_recorded(ticket); };
  disk_.on_write_error = [this](const std::string& error) {
    in_trouble_ = !error.empty();
    core_->on_journal_error(error);
  };
}

void GatewayProcess::plug(Controller& controller, LinkConditions& conditions) {
  plugged_.insert_or_assign(controller.name(), Machine{&controller, &conditions});
}

void GatewayProcess::start() {
  if (process().running()) {
    return;
  }
  process().start();
  disk_.writer = &journal_writer_.emplace(disk_, plan_.journal);
  const std::uint64_t new_epoch = (random_.next() >> 16U) | 1U;
  const auto loaded = journal_writer_->load(disk_.file(), new_epoch);
  const auto usable = loaded ? journal_writer_->begin() : tl::unexpected(loaded.error());
  if (!usable) {
    note("cannot start: " + usable.error());
    journal_writer_.reset();
    process().end();
    return;
  }
  note("starts; " + *loaded);
  if (const auto remains =
          process().agenda().meaning(random_.state(), words_for(journal_writer_->state()))) {
    process().agenda().becomes(process().parties() | process().outbox(), *remains);
  }
  checker_.on_start(journal_writer_->state().open_calls(), journal_writer_->state().numbers(),
                    plan_.file.policies);
  gateway::core::GatewayIdentity own;
  for (std::uint8_t& byte : own.id.bytes) {
    byte = static_cast<std::uint8_t>(random_.next());
  }
  own.host = name();
  own.epoch = journal_writer_->state().numbers().epoch;
  core_ = make_core(own);
  joined(fabric().join(process(), *this, *this));
  core_->start();
  if (plan_.watches_itself) {
    heartbeat();
  }
  tick();
}

void GatewayProcess::forget() {
  core_.reset();
  links_.clear();
  journal_writer_.reset();
  checker_.on_end();
  mistakes_.forget();
  ++wakes_;
  ending_ = false;
  in_trouble_ = false;
  statuses_.clear();
  served_.clear();
  for (const auto& [name, machine] : plugged_) {
    leaves_all_of(name);
  }
  process().end();
}

void GatewayProcess::kill(bool power) {
  if (!process().running()) {
    return;
  }
  note(power ? "loses its power" : "is killed");
  if (disk_.full) {
    note("its disk is full");
  }
  leave(false);
  forget();
  const bool lost = power && disk_.cut_power();
  if (power) {
    booted_ = random_.between(Time{}, 1000s) - Member::now() + 1000s;
  }
  if (plan_.in_memory) {
    disk_.wipe();
  }
  // With `always`, nothing is lost that anything relies on, and no loss is excused.
  const bool relied_on = plan_.journal.sync == journal::Sync::always && !plan_.in_memory;
  if ((lost || plan_.in_memory) && !relied_on) {
    lost_memory_ = true;
    history().add(JournalLost{plan_.number});
  }
}

void GatewayProcess::stop() {
  if (!process().awake() || ending_) {
    return;
  }
  note("is asked to end");
  ending_ = true;
  heartbeats_to_end_ = 0;
  core_->stop();
}

void GatewayProcess::reload(GatewayFile file) {
  plan_.file = std::move(file);
  if (process().running()) {
    process().after(Time{}, [this] { read_file(); });
  }
}

void GatewayProcess::read_file() {
  note("reads its configuration again");
  checker_.on_policies(plan_.file.policies);
  core_->change(plan_.file.machines, plan_.file.policies);
}

void GatewayProcess::cut_links(const std::string& machine, const std::string& reason) {
  const auto found = links_.find(machine);
  if (const auto link = found == links_.end() ? nullptr : found->second.lock()) {
    link->cut(reason);
  }
}

std::size_t GatewayProcess::open_calls() const {
  if (!journal_writer_) {
    return 0;
  }
  // An answered call may stay until its program sends the next request, where no read shows that it
  // is over.
  const auto calls = journal_writer_->state().open_calls();
  return static_cast<std::size_t>(std::ranges::count_if(
      calls, [](const gateway::CallRecord& call) { return !call.answer || !call.clearing; }));
}

std::size_t GatewayProcess::waiting_messages() const {
  std::size_t messages = 0;
  if (journal_writer_) {
    for (const auto& [key, queue_log] : journal_writer_->state().queues()) {
      messages += queue_log.waiting();
    }
  }
  return messages;
}

void GatewayProcess::answer(const Key& key, const fabric::CallId& call) {
  const std::string text = fmt::format("operator: {}", call.to_string());
  const auto verdict = core_->on_answer(key, call, {text, 77, "operator"});
  history().note("operator", fmt::format("answer {}: {}", call.to_string(), verdict.detail));
}

void GatewayProcess::retry(const Key& key, const fabric::CallId& call) {
  // The pause is not a result of the retry.
  core_->on_other_event();
  retrying_ = call;
  core_->on_retry(key, call, "operator");
  retrying_ = {};
}

void GatewayProcess::tick() {
  process().timer(plan_.journal.period, [this] {
    journal_writer_->on_tick();
    tick();
  });
}

void GatewayProcess::heartbeat() {
  if (ending_ && ++heartbeats_to_end_ == most_heartbeats_to_end) {
    history().violated(fmt::format("gateway {} was asked to end and goes on", plan_.number));
  }
  const auto next = core_->heartbeat();
  process().timer(next - now().steady, [this] { heartbeat(); });
}

// The inputs of a gateway: from instances, from other gateways, over its links.

void GatewayProcess::on_instance_ready(const fabric::InstanceIdentity& instance) {
  note("sees instance " + instance.id.to_string().substr(0, 8));
  checker_.on_ready(instance);
  core_->on_instance_ready(mistakes_.seen(instance));
}

void GatewayProcess::on_instance_changed(const fabric::InstanceIdentity& instance) {
  core_->on_other_event();
  checker_.on_ready(instance);
  core_->on_instance_ready(mistakes_.seen(instance));
}

void GatewayProcess::on_instance_gone(const fabric::InstanceId& instance) {
  // A gateway that stood still first does what is due, without knowledge of this event.
  core_->on_other_event();
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
  checker_.on_reply(reply, [&] { core_->on_reply(mistakes_.taken_for(reply, checker_)); });
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
  checker_.on_channel_status(status);
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

void GatewayProcess::on_link_down(const std::string& machine,
                                  const gateway::machines::LinkLoss& loss) {
  core_->on_link_down(machine, loss);
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

void GatewayProcess::on_read_failed(const Key& key, const fabric::Message& reason) {
  core_->on_read_failed(key, reason);
}

void GatewayProcess::on_write(const Key& key, WriteOutcome outcome, const fabric::Message& reason) {
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
