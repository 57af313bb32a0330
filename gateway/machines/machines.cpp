#include "gateway/machines/machines.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "gateway/machines/machines_impl.hpp"

namespace millrace::gateway::machines {

namespace {

std::string address_of(const settings::MachineSettings& settings) {
  constexpr std::size_t most = 127;
  return settings.address().substr(0, most);
}

bool same_way(const settings::MachineSettings& a, const settings::MachineSettings& b) {
  return a.host == b.host && a.tcp_port == b.tcp_port && a.net_id == b.net_id &&
         a.source == b.source && a.security == b.security && a.channels == b.channels &&
         a.symbol == b.symbol && a.groups == b.groups;
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

void Machines::Impl::set(const std::vector<settings::MachineSettings>& wanted) {
  std::set<std::string> names;
  for (const settings::MachineSettings& settings : wanted) {
    names.insert(settings.name);
    const auto found = machines.find(settings.name);
    if (found == machines.end()) {
      listen(add(settings));
    } else {
      change(found->second, settings);
    }
  }
  for (auto& [name, one] : machines) {
    if (!names.contains(name) && !one.leaving) {
      say(Level::info,
          fmt::format("{}: not in the configuration any more", one.settings.to_string()));
      one.leaving = true;
      for (const std::uint16_t channel : listener.channels_of(name)) {
        listener.on_retired({name, channel});
      }
      review_soon(name);
    }
  }
}

MachineState& Machines::Impl::add(const settings::MachineSettings& settings) {
  fabric::MachineStatus status;
  status.machine = settings.name;
  status.gateway = own.id;
  status.claimed = plausible(hands.now().wall);
  status.claims = settings.channels;
  status.address = address_of(settings);
  claims.expect(settings.name, status.address);
  status.poll = settings.pace.idle;
  status.host = own.host;
  status.pid = own.pid;
  status.version = own.version;
  status.epoch = own.epoch;
  return machines.emplace(settings.name, MachineState{settings, MachineReport(std::move(status))})
      .first->second;
}

void Machines::Impl::change(MachineState& one, const settings::MachineSettings& settings) {
  const bool same = same_way(one.settings, settings);
  const bool more = one.leaving || claims_more(settings.channels, one.settings.channels);
  one.settings = settings;
  one.leaving = false;
  one.report.set_poll(settings.pace.idle);
  one.report.set_address(address_of(settings));
  claims.expect(settings.name, one.report.status().address);
  if (same && !more) {
    carry_out(one, one.watch.set_mode(settings.watch));
    publish(one);
    return;
  }
  one.report.claim(more ? plausible(hands.now().wall) : one.report.status().claimed,
                   settings.channels);
  say(Level::info, fmt::format("{}: the configuration has changed", settings.to_string()));
  drop_link(one, "the configuration has changed");
  for (const std::uint16_t channel : listener.channels_of(settings.name)) {
    if (!settings.channels.empty() &&
        std::ranges::find(settings.channels, channel) == settings.channels.end()) {
      listener.on_retired({settings.name, channel});
    }
  }
  if (!one.listens) {
    review(settings.name);
  }
}

void Machines::Impl::connect(MachineState& one) {
  one.link = hands.connect(one.settings, *this);
  if (one.refusal.empty()) {
    one.report.on_down("connecting", hands.now());
  }
}

void Machines::Impl::drop_link(MachineState& one, const std::string& reason) {
  if (!one.link) {
    return;
  }
  one.link.reset();
  one.up = false;
  one.served.clear();
  forget_watch(one);
  listener.on_link_dropped(one.settings.name, reason);
}

void Machines::Impl::publish(MachineState& one) {
  if (const auto news = one.report.news()) {
    listener.on_machine_status(*news);
  }
}

Machines::Machines(GatewayIdentity own, MachinesIo& hands, MachinesListener& listener)
    : impl_(std::make_shared<Impl>(std::move(own), hands, listener)) {}

Machines::~Machines() = default;

void Machines::set(const std::vector<settings::MachineSettings>& machines) {
  impl_->set(machines);
}

void Machines::on_machine(const fabric::MachineStatus& status) {
  if (!impl_->take(status)) {
    // What it had said before may have stood in our way.
    impl_->review(status.machine);
    return;
  }
  if (const auto found = impl_->machines.find(status.machine); found != impl_->machines.end()) {
    impl_->listener.on_contested();
    MachineReport& ours = found->second.report;
    if (status.connected && ours.status().connected &&
        !impl_->claims.before(status, ours.status().claimed)) {
      // It may have taken us for gone, although we are there.
      ours.forget_told();
    }
    impl_->review(status.machine);
  }
}

void Machines::on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway) {
  const auto* const gone = impl_->claims.find(machine, gateway);
  if (gone != nullptr && (impl_->predecessors.size() < Claims::most_machines ||
                          impl_->predecessors.contains(machine))) {
    impl_->predecessors[machine] = name_of(*gone);
  }
  impl_->claims.remove(machine, gateway);
  impl_->review(machine);
}

void Machines::on_channel(const fabric::ChannelStatus& status) {
  // What an earlier run of this gateway did is in its journal; and who has no call in the channel
  // need not know of another one's, unless the channel is idle.
  if (status.call.epoch == impl_->own.epoch ||
      (status.call == fabric::CallId{} && status.state != fabric::ChannelState::idle)) {
    return;
  }
  if (impl_->claims.is_elsewhere(status.key.machine, status.call.epoch)) {
    return;
  }
  if (impl_->last_seen.size() >= most_channels && !impl_->last_seen.contains(status.key)) {
    impl_->complain("channels", "",
                    fmt::format("other gateways speak of more than {} channels; what goes on in "
                                "the others is not remembered",
                                most_channels));
    return;
  }
  // Also of machines that our configuration does not name now; it may name them again.
  impl_->last_seen.insert_or_assign(status.key, status);
  const auto machine = impl_->machines.find(status.key.machine);
  if (machine != impl_->machines.end() && machine->second.served.contains(status.key.channel)) {
    // Another gateway that did not hear us had it too.
    impl_->inherit(status.key);
  }
}

void Machines::on_over(const fabric::ChannelKey& key) {
  impl_->review_soon(key.machine);
}

bool Machines::stood_still() {
  bool contested = false;
  for (auto& [name, one] : impl_->machines) {
    one.report.forget_told();
    if (impl_->claims.contested(name)) {
      contested = true;
      if (one.link) {
        impl_->drop_link(one, "this gateway stood still");
        impl_->listen(one);
      }
    }
    impl_->publish(one);
  }
  return contested;
}

void Machines::tell_load() {
  for (const std::string& line : impl_->complaints.due(impl_->hands.now().steady)) {
    impl_->say(Level::warn, line);
  }
  for (auto& [name, one] : impl_->machines) {
    one.report.on_load(one.link ? one.link->load() : LinkLoad{}, impl_->hands.now().steady);
    impl_->publish(one);
  }
}

void Machines::read(const fabric::ChannelKey& key, ReadSet look) {
  MachineState& one = impl_->machines.at(key.machine);
  one.watch.looking(key.channel);
  one.link->read(key.channel, look);
}

void Machines::write(const fabric::ChannelKey& key, Variable variable, const Value& value) {
  MachineState& one = impl_->machines.at(key.machine);
  if (variable == Variable::request_state) {
    one.watch.on_cleared(key.channel);
  }
  one.link->write(key.channel, variable, value);
}

}  // namespace millrace::gateway::machines
