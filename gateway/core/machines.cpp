#include "gateway/core/machines.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"

namespace millrace::gateway::core {

namespace {

std::string address_of(const settings::MachineSettings& settings) {
  constexpr std::size_t most = 127;
  return settings.address().substr(0, most);
}

bool same_connection(const settings::MachineSettings& a, const settings::MachineSettings& b) {
  return a.controller == b.controller && a.channels == b.channels && a.symbol == b.symbol;
}

/// Of others' channels: far more than a fabric has.
constexpr std::size_t most_channels = 16'384;

/// Whether `more` claims a channel that `less` does not; none = all.
bool claims_more(const Channels& more, const Channels& less) {
  return !less.empty() && (more.empty() || std::ranges::any_of(more, [&](std::uint16_t channel) {
                             return std::ranges::find(less, channel) == less.end();
                           }));
}

}  // namespace

void Machines::set(const std::vector<settings::MachineSettings>& wanted, Moment now) {
  std::set<std::string> names;
  for (const settings::MachineSettings& settings : wanted) {
    names.insert(settings.name);
    const auto found = machines_.find(settings.name);
    if (found == machines_.end()) {
      listen(add(settings, now), now);
    } else {
      change(found->second, settings, now);
    }
  }
  for (auto& [name, machine] : machines_) {
    if (!names.contains(name) && !machine.removed) {
      host_.log(Level::info,
                fmt::format("{}: removed from the configuration", machine.settings.to_string()));
      machine.removed = true;
      for (const std::uint16_t channel : listener_.channels_of(name)) {
        remove(machine, channel, now);
      }
      reviews_.insert(name);
    }
  }
}

Machines::Machine& Machines::add(const settings::MachineSettings& settings, Moment now) {
  fabric::MachineStatus status;
  status.machine = settings.name;
  status.gateway = own_.id;
  status.claimed = machines::plausible(now.wall);
  status.claims = settings.channels;
  status.address = address_of(settings);
  claims_.set_address(settings.name, status.address);
  status.poll = settings.intervals.idle;
  status.host = own_.host;
  status.pid = own_.pid;
  status.version = own_.version;
  status.epoch = own_.epoch;
  status.journal = journal_;
  Machine& machine =
      machines_
          .try_emplace(settings.name, settings, machines::MachineStatusWriter(std::move(status)),
                       MachineValues(settings.name, fabric_, host_, own_.id))
          .first->second;
  values_of(machine).set(settings, now);
  return machine;
}

void Machines::change(Machine& machine, const settings::MachineSettings& settings, Moment now) {
  values_of(machine).set(settings, now);
  const bool same = same_connection(machine.settings, settings);
  const bool more = machine.removed || claims_more(settings.channels, machine.settings.channels);
  machine.settings = settings;
  machine.removed = false;
  machine.status_writer.set_poll(settings.intervals.idle);
  machine.status_writer.set_address(address_of(settings));
  claims_.set_address(settings.name, machine.status_writer.status().address);
  if (same && !more) {
    apply(machine, machine.subscriptions.set_mode(settings.watch), now);
    publish(machine);
    return;
  }
  machine.status_writer.claim(
      more ? machines::plausible(now.wall) : machine.status_writer.status().claimed,
      settings.channels);
  host_.log(Level::info, fmt::format("{}: the configuration has changed", settings.to_string()));
  drop_link(machine, base::messages::configuration_changed(), now);
  for (const std::uint16_t channel : listener_.channels_of(settings.name)) {
    if (!settings.channels.empty() &&
        std::ranges::find(settings.channels, channel) == settings.channels.end()) {
      remove(machine, channel, now);
    }
  }
  if (machine.listening() == nullptr) {
    review(settings.name, now);
  }
}

void Machines::connect(Machine& machine, Moment now) {
  machine.phase = Machine::Connected{host_.connect(machine.settings)};
  if (machine.refusal.empty()) {
    machine.status_writer.on_down("connecting", now);
  }
}

void Machines::drop_link(Machine& machine, const fabric::Message& reason, Moment now) {
  if (machine.connected() == nullptr) {
    return;
  }
  machine.phase = Machine::StandingBy{};
  forget_accounted(machine.settings.name);
  machine.subscriptions.link_down();
  values_of(machine).on_dropped(now);
  listener_.on_link_dropped(machine.settings.name, reason);
}

/// The channel was removed from the configuration.
void Machines::remove(Machine& machine, std::uint16_t channel, Moment now) {
  values_of(machine).on_over(channel, now);
  listener_.on_channel_removed({machine.settings.name, channel});
}

/// Another gateway serves it.
void Machines::not_owner(Machine& machine, std::uint16_t channel, const fabric::Message& reason,
                         Moment now) {
  values_of(machine).on_over(channel, now);
  forget_accounted(machine.settings.name, channel);
  listener_.on_not_owner({machine.settings.name, channel}, reason);
}

void Machines::publish(Machine& machine) {
  if (const auto news = machine.status_writer.take_change()) {
    fabric_.publish(*news);
  }
}

Machines::Machine* Machines::find_linked(const std::string& machine) {
  Machine& found = machines_.at(machine);
  return found.connected() != nullptr ? &found : nullptr;
}

void Machines::on_link_up(const std::string& machine, const Channels& channels, Moment now) {
  if (Machine* linked = find_linked(machine)) {
    linked->connected()->found = channels;
    serve(*linked, now);
  }
}

void Machines::on_link_down(const std::string& machine, const machines::LinkLoss& loss,
                            Moment now) {
  if (Machine* linked = find_linked(machine)) {
    linked->connected()->found.reset();
    linked->connected()->served.clear();
    linked->subscriptions.link_down();
    if (linked->refusal.empty()) {
      linked->status_writer.on_down(loss.reason, now, loss.silent_for);
    }
    values_of(*linked).on_down(loss.reason, now);
    listener_.on_lost(machine, loss.reason);
    publish(*linked);
  }
}

void Machines::on_machine(const fabric::MachineStatus& status, Moment now) {
  if (!note_claim(status, now)) {
    // Its earlier samples may have kept us from serving.
    review(status.machine, now);
    return;
  }
  if (const auto found = machines_.find(status.machine); found != machines_.end()) {
    fabric_.subscribe_channels();
    machines::MachineStatusWriter& own = found->second.status_writer;
    if (status.connected && own.status().connected &&
        !claims_.before(status, own.status().claimed)) {
      // It may have taken this gateway for gone.
      own.republish();
    }
    review(status.machine, now);
  }
}

void Machines::on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway,
                               Moment now) {
  const auto* const gone = claims_.find(machine, gateway);
  if (gone != nullptr && (others_.predecessors.size() < machines::Claims::most_machines ||
                          others_.predecessors.contains(machine))) {
    others_.predecessors[machine] = machines::name_of(*gone);
  }
  claims_.remove(machine, gateway);
  review(machine, now);
}

void Machines::on_channel(const fabric::ChannelStatus& status, Moment now) {
  const auto machine = machines_.find(status.key.machine);
  const bool serves = machine != machines_.end() && machine->second.serves(status.key.channel);
  // The calls of an earlier run of this gateway are in its journal; and a gateway without a call in
  // the channel need not know another one's, unless the channel is idle.
  if (status.call.epoch == own_.epoch ||
      (status.call == fabric::CallId{} && (serves || status.state != fabric::ChannelState::idle))) {
    return;
  }
  const auto known = others_.channels.find(status.key);
  if (known != others_.channels.end() && known->second.accounted &&
      known->second.status.call.epoch == status.call.epoch &&
      status.call.number <= known->second.status.call.number) {
    // A gateway that is back publishes the call of its journal before it knows that it stands by.
    return;
  }
  if (claims_.is_elsewhere(status.key.machine, status.call.epoch)) {
    return;
  }
  if (others_.channels.size() >= most_channels && !others_.channels.contains(status.key)) {
    warn_limited("channels", "",
                 fmt::format("other gateways publish the status of more than {} channels; the "
                             "status of further channels is ignored",
                             most_channels),
                 now);
    return;
  }
  // Also of machines that our configuration does not name now; it may name them again.
  others_.channels.insert_or_assign(status.key, OtherStatus{status});
  if (serves) {
    // Another gateway that did not receive our samples had it too.
    on_predecessor_call(status.key);
  }
}

bool Machines::on_stall(Moment now) {
  bool contested = false;
  for (auto& [name, machine] : machines_) {
    machine.status_writer.republish();
    if (claims_.contested(name)) {
      contested = true;
      if (machine.connected() != nullptr) {
        drop_link(machine, base::messages::stood_still(), now);
        listen(machine, now);
      }
    }
    publish(machine);
  }
  return contested;
}

void Machines::set_journal(fabric::JournalState state) {
  journal_ = state;
  for (auto& [name, machine] : machines_) {
    machine.status_writer.set_journal(state);
    publish(machine);
  }
}

void Machines::publish_load(Moment now) {
  for (const std::string& line : log_limiter_.due(now.steady)) {
    host_.log(Level::warn, line);
  }
  for (auto& [name, machine] : machines_) {
    const auto* const connected = machine.connected();
    machine.status_writer.on_load(
        connected != nullptr ? connected->link->load() : machines::LinkLoad{}, now.steady);
    publish(machine);
  }
}

void Machines::read(const fabric::ChannelKey& key, ReadSet set) {
  Machine& machine = machines_.at(key.machine);
  machine.subscriptions.read_started(key.channel);
  Machine::Connected& connected = std::get<Machine::Connected>(machine.phase);
  ++connected.calls_under_way;
  connected.link->read(key.channel, set);
}

void Machines::write(const fabric::ChannelKey& key, const Write& write, Moment) {
  Machine& machine = machines_.at(key.machine);
  if (write.variable == Variable::request_state) {
    machine.subscriptions.on_cleared(key.channel);
  }
  Machine::Connected& connected = std::get<Machine::Connected>(machine.phase);
  ++connected.calls_under_way;
  connected.link->write(key.channel, write.variable, write.value);
}

void Machines::on_call_answered(const std::string& machine, Moment now) {
  Machine::Connected& connected = std::get<Machine::Connected>(machines_.at(machine).phase);
  if (connected.calls_under_way > 0 && --connected.calls_under_way == 0) {
    connected.rests_since = now.steady;
  }
}

void Machines::on_answer(const std::string& machine, const machines::Answer& answer, Moment now) {
  if (const auto found = machines_.find(machine); found != machines_.end()) {
    values_of(found->second).on_answer(answer, now);
  }
}

void Machines::on_request(const fabric::VariableRequest& request, Moment now) {
  if (const auto found = machines_.find(request.key.machine); found != machines_.end()) {
    values_of(found->second).on_request(request, now);
  }
}

machines::Controller* Machines::link_of(const std::string& machine) const {
  const auto found = machines_.find(machine);
  const auto* const connected = found == machines_.end() ? nullptr : found->second.connected();
  return connected == nullptr ? nullptr : connected->link.get();
}

void Machines::finish(Moment now) {
  while (!reviews_.empty()) {
    review(reviews_.extract(reviews_.begin()).value(), now);
  }
}

MachineValues& Machines::values_of(Machine& machine) {
  values_due_.now = true;
  return machine.values;
}

void Machines::ask_values(Moment now) {
  if (!values_due_.now && (!values_due_.at || *values_due_.at > now.steady)) {
    return;
  }
  values_due_ = {};
  for (auto& [name, machine] : machines_) {
    if (machine.values.is_due(now)) {
      const auto* const connected = machine.connected();
      machine.values.pump(connected != nullptr ? connected->link.get() : nullptr,
                          connected == nullptr || connected->calls_under_way > 0
                              ? std::nullopt
                              : std::optional(connected->rests_since),
                          now);
    }
    values_due_.now = values_due_.now || machine.values.gives_way();
    values_due_.at = earliest({values_due_.at, machine.values.next_time()});
  }
}

std::optional<SteadyTime> Machines::next_time() const {
  return earliest({next_, values_due_.at});
}

void Machines::on_time(Moment now) {
  if (!next_ || now.steady < *next_) {
    return;
  }
  next_.reset();
  for (auto next = machines_.begin(); next != machines_.end();) {
    // It may leave.
    Machine& machine = (next++)->second;
    const auto subscriptions_time = machine.subscriptions.next_time();
    const Machine::Listening* const listening = machine.listening();
    const auto listens_until = listening ? std::optional(listening->until) : std::nullopt;
    if (subscriptions_time && *subscriptions_time <= now.steady) {
      apply(machine, machine.subscriptions.on_time(now.steady), now);
    } else {
      wake_at(subscriptions_time);
    }
    if (listens_until && *listens_until <= now.steady) {
      listened(machine, now);
    } else {
      wake_at(listens_until);
    }
  }
}

void Machines::wake_at(std::optional<SteadyTime> time) {
  next_ = earliest({next_, time});
}

}  // namespace millrace::gateway::core
