#include "tests/simulation/gateway/gateway_process.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace millrace::tests::simulation {

namespace journal = gateway::journal;
using gateway::Variable;
using gateway::WriteOutcome;

namespace {

/// Any moment will do.
constexpr fabric::Time epoch{std::chrono::hours(24 * 365 * 55)};

constexpr Time patience_at_the_end = 2000ms;

}  // namespace

GatewayProcess::GatewayProcess(GatewayPlan plan, Agenda& agenda, Party party, History& history,
                               Fabric& fabric, Random random)
    : plan_(std::move(plan)),
      agenda_(agenda),
      history_(history),
      fabric_(fabric),
      random_(random),
      process_(agenda, party),
      disk_(process_, random_.fork()) {
  disk_.on_forced = [this](const std::string& failure) { keeper_->on_forced(failure); };
  disk_.on_trouble = [this](const std::string& trouble) {
    in_trouble_ = !trouble.empty();
    if (!ending_) {
      carry_out(core_->set_obstacle(trouble, moment()));
    }
  };
}

void GatewayProcess::serve(Controller& controller, Cable& cable) {
  machines_.push_back({&controller, &cable});
}

gateway::Moment GatewayProcess::moment() const {
  const Time now = agenda_.now();
  return {gateway::SteadyTime(booted_ + now), epoch + now + clock_error_};
}

void GatewayProcess::start() {
  if (process_.running()) {
    return;
  }
  process_.start();
  keeper_.emplace(disk_, plan_.journal);
  const std::uint64_t new_epoch = (random_.next() >> 16U) | 1U;
  const auto loaded = keeper_->load(disk_.file(), new_epoch);
  const auto usable = loaded ? keeper_->rewrite() : tl::unexpected(loaded.error());
  if (!usable) {
    history_.note(fmt::format("gateway {}", plan_.number), "cannot start: " + usable.error());
    keeper_.reset();
    process_.end();
    return;
  }
  history_.note(fmt::format("gateway {}", plan_.number), "starts; " + *loaded);
  for (const gateway::Call& call : keeper_->ledger().open_calls()) {
    current_[call.key] = {call.id, call.request, call.answer};
  }
  core_.emplace(plan_.core, keeper_->ledger());
  end_ = fabric_.join(process_, *this);
  for (const Machine& machine : machines_) {
    auto link = std::make_shared<AdsLink>(process_, plan_.number, *machine.controller,
                                          *machine.cable, *this, history_, random_.fork());
    link->start();
    links_.emplace(machine.controller->name(), std::move(link));
  }
  tick();
}

void GatewayProcess::forget() {
  for (auto& [machine, link] : links_) {
    link->abandon();
  }
  links_.clear();
  core_.reset();
  keeper_.reset();
  wakes_.clear();
  armed_.reset();
  ending_ = false;
  in_trouble_ = false;
  statuses_.clear();
  current_.clear();
  ready_.clear();
  given_.clear();
  last_looks_.clear();
  last_states_.clear();
  texts_read_.clear();
  held_texts_.clear();
  last_writes_.clear();
  process_.end();
}

void GatewayProcess::kill(bool power) {
  if (!process_.running()) {
    return;
  }
  history_.note(fmt::format("gateway {}", plan_.number), power ? "loses its power" : "is killed");
  fabric_.leave(*std::exchange(end_, {}), false);
  forget();
  const bool lost = power && disk_.cut_power();
  if (power) {
    booted_ = random_.between(Time{}, 1000s) - agenda_.now() + 1000s;
  }
  if (plan_.in_memory) {
    disk_.wipe();
  }
  // With `always` nothing is lost that somebody relies on, and nothing is forgiven.
  const bool relied_on = plan_.journal.sync == journal::Sync::always && !plan_.in_memory;
  if ((lost || plan_.in_memory) && !relied_on) {
    lost_memory_ = true;
    history_.add(JournalLost{plan_.number});
  }
}

void GatewayProcess::stop() {
  if (!process_.awake() || ending_) {
    return;
  }
  history_.note(fmt::format("gateway {}", plan_.number), "is asked to end");
  ending_ = true;
  process_.timer(patience_at_the_end, [this] {
    if (ending_) {
      history_.note(fmt::format("gateway {}", plan_.number), "ends with an answer half written");
      fabric_.leave(*std::exchange(end_, {}), true);
      forget();
    }
  });
  carry_out(core_->set_obstacle("the gateway is ending", moment()));
}

void GatewayProcess::freeze() {
  if (!process_.awake()) {
    return;
  }
  history_.note(fmt::format("gateway {}", plan_.number), "is frozen");
  frozen_at_ = agenda_.now();
  process_.freeze();
  fabric_.frozen(*end_);
}

void GatewayProcess::thaw() {
  if (!process_.frozen()) {
    return;
  }
  history_.note(fmt::format("gateway {}", plan_.number), "goes on");
  process_.thaw();
  fabric_.thawed(*end_, agenda_.now() - frozen_at_);
}

void GatewayProcess::cut_links(const std::string& machine, const std::string& reason) {
  if (const auto found = links_.find(machine); found != links_.end()) {
    found->second->cut(reason);
  }
}

std::size_t GatewayProcess::open_calls() const {
  return keeper_ ? keeper_->ledger().open_calls().size() : 0;
}

void GatewayProcess::learn(const fabric::InstanceIdentity& instance) {
  fabric::InstanceIdentity known = instance;
  if (plan_.bug == Bug::at_most_once_forgotten) {
    known.delivery = fabric::Delivery::at_least_once;
  }
  if (plan_.bug == Bug::given_to_the_busy) {
    known.concurrency = 1000;
  }
  carry_out(core_->on_instance_ready(known, moment()));
}

void GatewayProcess::on_instance_ready(const fabric::InstanceIdentity& instance) {
  history_.note(fmt::format("gateway {}", plan_.number),
                "sees instance " + instance.id.to_string().substr(0, 8));
  ready_[instance.id] = instance;
  learn(instance);
}

void GatewayProcess::on_instance_changed(const fabric::InstanceIdentity& instance) {
  ready_[instance.id] = instance;
  learn(instance);
}

void GatewayProcess::on_instance_gone(const fabric::InstanceId& instance) {
  history_.note(fmt::format("gateway {}", plan_.number),
                "loses instance " + instance.to_string().substr(0, 8));
  ready_.erase(instance);
  if (plan_.bug != Bug::instance_loss_ignored) {
    carry_out(core_->on_instance_gone(instance, moment()));
  }
}

void GatewayProcess::on_reply(const fabric::Reply& reply) {
  if (plan_.bug == Bug::reply_by_channel) {
    fabric::Reply taken = reply;
    if (const auto current = current_.find(reply.key); current != current_.end()) {
      taken.call = current->second.call;
    }
    carry_out(core_->on_reply(taken, moment()));
    return;
  }
  carry_out(core_->on_reply(reply, moment()));
}

void GatewayProcess::on_link_up(const std::string& machine,
                                const std::vector<std::uint16_t>& channels) {
  carry_out(core_->on_link_up(machine, channels, moment()));
}

void GatewayProcess::on_link_down(const std::string& machine, const std::string& reason) {
  carry_out(core_->on_link_down(machine, reason, moment()));
}

void GatewayProcess::on_read(const Key& key, const gateway::Picture& picture, Time first) {
  history_.add(Looked{plan_.number, key, picture, first});
  if (picture.look == gateway::Look::request) {
    last_looks_[key] = picture;
  } else if (picture.look == gateway::Look::state) {
    last_states_[key] = picture;
  } else if (picture.look == gateway::Look::texts) {
    texts_read_.insert_or_assign(key, picture);
  }
  carry_out(core_->on_read(key, picture, moment()));
}

void GatewayProcess::on_read_failed(const Key& key, const std::string& reason) {
  carry_out(core_->on_read_failed(key, reason, moment()));
}

void GatewayProcess::on_write(const Key& key, WriteOutcome outcome, const std::string& reason) {
  if (plan_.bug == Bug::unknown_write_repeated && outcome == WriteOutcome::unknown &&
      reason == "timeout") {
    carry_out(key, last_writes_.at(key));
    return;
  }
  carry_out(core_->on_write(key, outcome, reason, moment()));
}

void GatewayProcess::answer(const Key& key, const fabric::CallId& call) {
  gateway::Verdict verdict;
  const std::string text = fmt::format("operator: {}", call.to_string());
  auto actions = core_->on_answer(key, call, {text, 77, "operator"}, verdict, moment());
  history_.note("operator", fmt::format("answer {}: {}", call.to_string(), verdict.detail));
  carry_out(actions);
}

void GatewayProcess::retry(const Key& key, const fabric::CallId& call) {
  gateway::Verdict verdict;
  auto actions = core_->on_retry(key, call, "operator", verdict, moment());
  if (verdict.done) {
    given_.erase(call);
    history_.add(Retried{call});
  }
  carry_out(actions);
}

void GatewayProcess::carry_out(const gateway::ChannelActions& actions) {
  for (const gateway::ChannelAction& one : actions) {
    std::visit([&](const auto& action) { carry_out(one.key, action); }, one.action);
  }
  arm_timer();
  if (ending_ && !core_->answering()) {
    ending_ = false;
    process_.after(Time{}, [this] {
      history_.note(fmt::format("gateway {}", plan_.number), "has ended");
      fabric_.leave(*std::exchange(end_, {}), true);
      forget();
    });
  }
}

void GatewayProcess::carry_out(const Key& key, const gateway::Read& action) {
  const auto seen = last_looks_.find(key);
  const auto current = current_.find(key);
  if (plan_.bug == Bug::answer_without_look && action.look == gateway::Look::request &&
      current != current_.end() && current->second.answer && seen != last_looks_.end()) {
    process_.after(Time{}, [this, key, picture = seen->second] {
      carry_out(core_->on_read(key, picture, moment()));
    });
    return;
  }
  const auto texts = texts_read_.extract(key);
  if (plan_.bug == Bug::no_confirming_look && !texts.empty() &&
      action.look == gateway::Look::request) {
    gateway::Picture unread = texts.mapped();
    unread.look = action.look;
    unread.request_state = last_states_.at(key).request_state;
    process_.after(Time{}, [this, key, picture = unread] {
      carry_out(core_->on_read(key, picture, moment()));
    });
    return;
  }
  link(key.machine).read(key.channel, action.look);
}

void GatewayProcess::carry_out(const Key& key, const gateway::Write& action) {
  const Current& current = current_.at(key);
  last_writes_.insert_or_assign(key, action);
  if (plan_.bug == Bug::state_before_text && action.variable == Variable::response &&
      current.answer) {
    held_texts_[key] = action.value;
    process_.after(Time{}, [this, key] { on_write(key, WriteOutcome::written, ""); });
    return;
  }
  history_.add(WriteAsked{plan_.number, key, current.call, current.request, action.variable});
  // An interim answer may still be on its way when the final one is there.
  const bool is_final = current.answer && action.value == gateway::Value{current.answer->state};
  link(key.machine)
      .write(key.channel, {action.variable, action.value, current.call, current.request,
                           is_final ? current.answer : std::nullopt});
}

void GatewayProcess::carry_out(const Key& key, const gateway::WakeAt& action) {
  const auto known = wakes_.find(key);
  if (known != wakes_.end() && known->second == action.at) {
    return;
  }
  wakes_[key] = action.at;
  const std::uint64_t number = ++wake_numbers_[key];
  const Time delay = action.at - moment().steady;
  process_.timer(std::max(delay, Time{}), [this, key, number] {
    if (wake_numbers_[key] == number) {
      carry_out(core_->on_wake(key, moment()));
    }
  });
}

void GatewayProcess::carry_out(const Key& key, const gateway::Record& action) {
  observe(key, action.entry);
  const bool skipped = (plan_.bug == Bug::clearing_not_journalled &&
                        std::holds_alternative<journal::Clearing>(action.entry)) ||
                       (plan_.bug == Bug::numbers_not_journalled &&
                        std::holds_alternative<journal::Numbers>(action.entry));
  auto recorded = [this, key, ticket = action.ticket] {
    carry_out(core_->on_recorded(key, ticket, moment()));
  };
  if (skipped) {
    process_.after(Time{}, std::move(recorded));
  } else if (plan_.bug == Bug::recorded_before_forced) {
    keeper_->append(action.entry, [] {});
    process_.after(Time{}, std::move(recorded));
  } else {
    keeper_->append(action.entry, std::move(recorded));
  }
}

void GatewayProcess::observe(const Key& key, const journal::Entry& entry) {
  if (const auto* dispatched = std::get_if<journal::Dispatched>(&entry)) {
    if (dispatched->attempt > 0) {
      given_out(*dispatched);
    }
  } else if (const auto* answered = std::get_if<journal::Answered>(&entry)) {
    current_.at(key).answer = answered->answer;
    given_.erase(answered->call);
  } else if (const auto* ended = std::get_if<journal::Ended>(&entry)) {
    given_.erase(ended->call);
    history_.add(Ended{plan_.number, ended->call});
  }
}

void GatewayProcess::given_out(const journal::Dispatched& entry) {
  GivenOut fact;
  fact.gateway = plan_.number;
  fact.key = entry.key;
  fact.call = entry.call;
  fact.attempt = entry.attempt;
  fact.instance = entry.instance;
  const auto found = ready_.find(entry.instance);
  fact.ready = found != ready_.end() && !found->second.draining &&
               found->second.uuid == fabric::canonical_uuid(entry.request.uuid);
  if (found != ready_.end()) {
    fact.room = found->second.concurrency;
    const auto& scopes = found->second.channels;
    fact.ready =
        fact.ready && (scopes.empty() || std::ranges::any_of(scopes, [&](const auto& one) {
                         return (one.machine.empty() || one.machine == entry.key.machine) &&
                                (one.channel == 0 || one.channel == entry.key.channel);
                       }));
  }
  fact.load = static_cast<std::uint32_t>(std::ranges::count_if(given_, [&](const auto& one) {
    return one.second == entry.instance && one.first != entry.call;
  }));
  given_[entry.call] = entry.instance;
  history_.add(fact);
}

void GatewayProcess::carry_out(const Key&, const gateway::Publish& action) {
  if (!fabric_.publish(*end_, action.request)) {
    history_.violated(
        fmt::format("{} cannot be given out: no writer", action.request.call.to_string()));
  }
}

void GatewayProcess::carry_out(const Key& key, const gateway::Withdraw& action) {
  fabric_.withdraw(*end_, key, action.uuid);
}

void GatewayProcess::carry_out(const Key& key, const gateway::Tell& action) {
  const fabric::Event& event = action.event;
  if (event.kind == fabric::EventKind::seen) {
    const gateway::PendingRequest request{event.uuid, event.text, event.state};
    current_[key] = {event.call, request, {}};
    history_.add(Claimed{plan_.number, key, event.call, request, in_trouble_});
  } else if (event.kind == fabric::EventKind::lost || event.kind == fabric::EventKind::refused) {
    given_.erase(event.call);
  }
}

void GatewayProcess::carry_out(const Key& key, const gateway::Show& action) {
  statuses_[key] = action.status;
}

void GatewayProcess::carry_out(const Key& key, const gateway::Say& action) {
  history_.note(fmt::format("gateway {} says of {}", plan_.number, key.to_string()), action.text);
}

void GatewayProcess::carry_out(const Key& key, const gateway::Hide&) {
  ++wake_numbers_[key];
  wakes_.erase(key);
  statuses_.erase(key);
}

void GatewayProcess::arm_timer() {
  const auto next = core_->next_time();
  if (next == armed_) {
    return;
  }
  armed_ = next;
  const std::uint64_t number = ++armed_number_;
  if (!next) {
    return;
  }
  process_.timer(std::max(Time(*next - moment().steady), Time{}), [this, number] {
    if (number == armed_number_) {
      armed_.reset();
      carry_out(core_->on_time(moment()));
    }
  });
}

void GatewayProcess::tick() {
  process_.timer(plan_.journal.period, [this] {
    keeper_->on_tick();
    tick();
  });
}

}  // namespace millrace::tests::simulation
