#include "tests/simulation/gateway/gateway_process.hpp"

#include <utility>

#include <fmt/format.h>

namespace millrace::tests::simulation {

namespace journal = gateway::journal;
using gateway::WriteOutcome;

namespace {

constexpr Time patience_at_the_end = 2000ms;

/// All that a gateway knows when it starts, but for times.
std::string words_for(const journal::Ledger& ledger) {
  std::string words = fmt::format("{} {}", ledger.numbers().epoch, ledger.numbers().reserved);
  for (const gateway::Call& call : ledger.open_calls()) {
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
                               Fabric& fabric, Random random)
    : Member(fmt::format("gateway {}", plan.number), agenda, party, history, fabric),
      plan_(std::move(plan)),
      random_(random),
      disk_(process(), random_.fork(), plan_.bug),
      witness_(plan_.number, history),
      mistakes_(plan_.bug) {
  disk_.on_recorded = [this](const gateway::Ticket& ticket) { on_recorded(ticket); };
  disk_.on_trouble = [this](const std::string& trouble) {
    in_trouble_ = !trouble.empty();
    begin_event();
    if (!ending_) {
      carry_out(control_->set_journal_trouble(trouble, now()));
    }
  };
}

void GatewayProcess::plug(Controller& controller, Cable& cable) {
  plugged_.insert_or_assign(controller.name(), Machine{&controller, &cable});
}

gateway::Moment GatewayProcess::moment() const {
  return {gateway::SteadyTime(booted_ + Member::now()), wall()};
}

gateway::Moment GatewayProcess::now() const {
  if (stall_ && stall_->overdue(moment().steady)) {
    history().violated(name() + " decides before it notices that it stood still");
  }
  return moment();
}

void GatewayProcess::begin_event() {
  if (stall_ && stall_->late(moment().steady)) {
    note("notices that it stood still");
    machines_->stood_still();
  }
}

void GatewayProcess::start() {
  if (process().running()) {
    return;
  }
  process().start();
  disk_.keeper = &keeper_.emplace(disk_, plan_.journal);
  const std::uint64_t new_epoch = (random_.next() >> 16U) | 1U;
  const auto loaded = keeper_->load(disk_.file(), new_epoch);
  const auto usable = loaded ? keeper_->begin() : tl::unexpected(loaded.error());
  if (!usable) {
    note("cannot start: " + usable.error());
    keeper_.reset();
    process().end();
    return;
  }
  note("starts; " + *loaded);
  if (const auto remains =
          process().agenda().meaning(random_.state(), words_for(keeper_->ledger()))) {
    process().agenda().becomes(process().parties() | process().outbox(), *remains);
  }
  witness_.on_start(keeper_->ledger().open_calls(), plan_.file.policies);
  control_.emplace(gateway::control::CallControlOptions{.paces = gateway::settings::paces_of(
                                                            plan_.file.machines),
                                                        .policies = plan_.file.policies},
                   keeper_->ledger());
  gateway::machines::GatewayIdentity own;
  for (std::uint8_t& byte : own.id.bytes) {
    byte = static_cast<std::uint8_t>(random_.next());
  }
  own.host = name();
  own.epoch = keeper_->ledger().numbers().epoch;
  machines_ = std::make_unique<gateway::machines::Machines>(own, *this, *this);
  queues_.emplace(*this, *this);
  joined(fabric().join(process(), *this, *this));
  queues_->set(gateway::settings::queues_of(plan_.file.machines), keeper_->ledger().queues());
  machines_->set(plan_.file.machines);
  if (plan_.watches_itself) {
    stall_.emplace(fabric().weather.lease);
    beat();
  }
  tick();
}

void GatewayProcess::forget() {
  queues_.reset();
  machines_.reset();
  gate_.reset();
  links_.clear();
  control_.reset();
  keeper_.reset();
  stall_.reset();
  witness_.on_end();
  mistakes_.forget();
  armed_.reset();
  ending_ = false;
  in_trouble_ = false;
  statuses_.clear();
  served_.clear();
  process().end();
}

void GatewayProcess::kill(bool power) {
  if (!process().running()) {
    return;
  }
  note(power ? "loses its power" : "is killed");
  leave(false);
  forget();
  const bool lost = power && disk_.cut_power();
  if (power) {
    booted_ = random_.between(Time{}, 1000s) - Member::now() + 1000s;
  }
  if (plan_.in_memory) {
    disk_.wipe();
  }
  // With `always` nothing is lost that somebody relies on, and nothing is forgiven.
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
  process().timer(patience_at_the_end, [this] {
    if (ending_) {
      ending_ = false;
      begin_event();
      carry_out(control_->take_back(now()));
      note("ends with an answer half written");
      leave(true);
      forget();
    }
  });
  begin_event();
  carry_out(control_->set_obstacle("the gateway is ending", now()));
}

void GatewayProcess::end_when_answered() {
  if (!ending_ || control_->answering()) {
    return;
  }
  ending_ = false;
  process().after(Time{}, [this] {
    begin_event();
    carry_out(control_->take_back(now()));
    note("has ended");
    leave(true);
    forget();
  });
}

void GatewayProcess::reload(GatewayFile file) {
  plan_.file = std::move(file);
  if (process().running()) {
    process().after(Time{}, [this] { read_file(); });
  }
}

void GatewayProcess::read_file() {
  note("reads its configuration again");
  begin_event();
  witness_.on_policies(plan_.file.policies);
  carry_out(control_->change(gateway::settings::paces_of(plan_.file.machines), plan_.file.policies,
                             now()));
  queues_->set(gateway::settings::queues_of(plan_.file.machines), keeper_->ledger().queues());
  machines_->set(plan_.file.machines);
}

void GatewayProcess::cut_links(const std::string& machine, const std::string& reason) {
  const auto found = links_.find(machine);
  if (const auto link = found == links_.end() ? nullptr : found->second.lock()) {
    link->cut(reason);
  }
}

std::size_t GatewayProcess::open_calls() const {
  if (!keeper_) {
    return 0;
  }
  // One that is answered may stay until its program asks again, where no read shows that it is
  // over.
  const auto calls = keeper_->ledger().open_calls();
  return static_cast<std::size_t>(std::ranges::count_if(
      calls, [](const gateway::Call& call) { return !call.answer || !call.clearing; }));
}

std::size_t GatewayProcess::waiting_messages() const {
  std::size_t messages = 0;
  if (keeper_) {
    for (const auto& [key, book] : keeper_->ledger().queues()) {
      messages += book.waiting();
    }
  }
  return messages;
}

void GatewayProcess::answer(const Key& key, const fabric::CallId& call) {
  gateway::control::Verdict verdict;
  const std::string text = fmt::format("operator: {}", call.to_string());
  begin_event();
  auto actions = control_->on_answer(key, call, {text, 77, "operator"}, verdict, now());
  history().note("operator", fmt::format("answer {}: {}", call.to_string(), verdict.detail));
  carry_out(actions);
}

void GatewayProcess::retry(const Key& key, const fabric::CallId& call) {
  gateway::control::Verdict verdict;
  begin_event();
  auto actions = control_->on_retry(key, call, "operator", verdict, now());
  if (verdict.done) {
    witness_.on_retried(call);
  }
  carry_out(actions);
}

void GatewayProcess::tick() {
  process().timer(plan_.journal.period, [this] {
    keeper_->on_tick();
    tick();
  });
}

void GatewayProcess::beat() {
  begin_event();
  const auto next = stall_->beat(now().steady);
  process().timer(next - now().steady, [this] { beat(); });
}

}  // namespace millrace::tests::simulation
