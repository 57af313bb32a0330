// Ownership of machines and channels among gateways.
#include <utility>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "gateway/core/machines.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway::core {

namespace {

/// How long a gateway waits for others before it serves: discovery takes some 10 ms on a quiet
/// host.
constexpr std::chrono::milliseconds listen_time{300};

/// A timer that is later than this shows a busy host, where discovery is late too: wait longer.
constexpr std::chrono::milliseconds most_late{50};

/// But not for ever: a host may always be busy, and a participant of another plant never proves who
/// it is.
constexpr std::chrono::seconds longest_listen{3};

/// May the call have been dispatched to an instance? One that waited may have been dispatched
/// since, by a gateway that is not received and not gone. A gateway that ends publishes of which
/// calls that is not so.
bool under_way(const fabric::ChannelStatus& status) {
  return status.call != fabric::CallId{};
}

}  // namespace

void Machines::listen(Machine& machine, Moment now) {
  const SteadyTime since = machine.listening() != nullptr ? machine.listening()->since : now.steady;
  const SteadyTime until = now.steady + listen_time;
  machine.phase = Machine::Listening{since, until};
  wake_at(until);
  machine.status_writer.on_down(base::messages::looks_for_other_gateway(), now);
  publish(machine);
}

void Machines::listened(Machine& listener, Moment now) {
  const Machine::Listening& listening = *listener.listening();
  const bool may_be_incomplete =
      now.steady - listening.until > most_late || fabric_.awaits_authentication();
  if (may_be_incomplete && now.steady - listening.since < longest_listen) {
    listen(listener, now);
    return;
  }
  const std::string machine = listener.settings.name;
  listener.phase = Machine::StandingBy{};
  if (!listener.has_served) {
    const auto claimed = claims_.after_owners(machine, listener.status_writer.status().claimed);
    listener.status_writer.claim(claimed, listener.settings.channels);
  }
  review(machine, now);
}

bool Machines::note_claim(const fabric::MachineStatus& status, Moment now) {
  const std::string who = machines::name_of(status);
  const std::string machine = printable(status.machine);
  switch (claims_.set(status)) {
    case machines::Claims::Accepted::yes:
      return true;
    case machines::Claims::Accepted::implausible:
      warn_limited(
          "implausible", machine,
          fmt::format(
              "{}: {} claims this machine since an impossible time (claimed={}); ignored. Its "
              "sender is not a gateway of this plant, or its clock is wrong: see "
              "docs/how-to/secure-a-network.md",
              machine, who, status.claimed.time_since_epoch().count()),
          now);
      return false;
    case machines::Claims::Accepted::another_controller:
      if (machines_.contains(status.machine)) {
        warn_limited("another", machine,
                     fmt::format("{}: {} serves another controller ({}) under the same machine "
                                 "name; tools cannot tell the two apart: rename one of them",
                                 machine, who, printable(status.address)),
                     now);
      }
      return false;
    case machines::Claims::Accepted::full:
      warn_limited("claims", "",
                   fmt::format("the claim of {} on {} is ignored: more than {} machines, or more "
                               "than {} gateways of one machine, are announced on this fabric",
                               who, machine, machines::Claims::most_machines,
                               machines::Claims::most_gateways),
                   now);
      return false;
  }
  return true;
}

void Machines::warn_limited(const std::string& kind, const std::string& about,
                            const std::string& text, Moment now) {
  if (const auto line = log_limiter_.admit(kind, about, text, now.steady)) {
    host_.log(Level::warn, *line);
  }
}

void Machines::review(const std::string& machine, Moment now) {
  const auto found = machines_.find(machine);
  if (found == machines_.end() || found->second.listening() != nullptr) {
    return;
  }
  Machine& known = found->second;
  if (known.removed && listener_.channels_of(machine).empty()) {
    fabric::MachineStatus last = known.status_writer.status();
    last.reason = base::messages::machine_removed();
    machines_.erase(found);
    fabric_.dispose(last);
    return;
  }
  if (!known.removed && owned_by_others(known, now)) {
    // A call with a half-written response is completed in any case.
    if (listener_.channels_of(machine).empty()) {
      drop_link(known, known.refusal, now);
    } else if (known.connected() == nullptr) {
      connect(known, now);
    }
    publish(known);
    return;
  }
  if (known.connected() == nullptr) {
    connect(known, now);
  } else if (known.connected()->found) {
    serve(known, now);
  }
  publish(known);
}

bool Machines::owned_by_others(Machine& machine, Moment now) {
  const std::string& name = machine.settings.name;
  const auto* other = claims_.owner_of_all_before(name, machine.settings.channels,
                                                  machine.status_writer.status().claimed);
  if (other == nullptr) {
    if (!machine.refusal.empty()) {
      host_.log(Level::warn, fmt::format("{}: taken over: {} is gone", machine.settings.to_string(),
                                         others_.predecessors[name]));
      machine.refusal.clear();
    }
    return false;
  }
  const fabric::Message refusal = base::messages::stands_by(machines::name_of(*other));
  if (machine.refusal != refusal) {
    machine.refusal = refusal;
    host_.log(Level::warn, fmt::format("{}: {}", machine.settings.to_string(), refusal));
  }
  for (const std::uint16_t channel : listener_.channels_of(name)) {
    not_owner(machine, channel, refusal, now);
  }
  if (auto* const connected = machine.connected()) {
    connected->served.clear();
  }
  forget_accounted(name);
  machine.status_writer.on_down(refusal, now);
  return true;
}

void Machines::serve(Machine& machine, Moment now) {
  const std::string& name = machine.settings.name;
  Machine::Connected& connected = std::get<Machine::Connected>(machine.phase);
  Channels own;
  fabric::Message refused;
  for (const std::uint16_t channel :
       machine.removed || !machine.refusal.empty() ? Channels{} : *connected.found) {
    const fabric::ChannelKey key{name, channel};
    const auto* other = claims_.owner_before(key, machine.status_writer.status().claimed);
    if (other == nullptr) {
      own.push_back(channel);
      continue;
    }
    const fabric::Message reason =
        base::messages::channel_served(channel, machines::name_of(*other));
    refused = refused.empty() ? reason : base::messages::and_also(refused, reason);
    not_owner(machine, channel, reason, now);
  }
  if (!refused.empty() && refused != machine.note) {
    host_.log(Level::warn, fmt::format("{}: {}; this gateway stands by for it",
                                       machine.settings.to_string(), refused));
  }
  for (const std::uint16_t channel : own) {
    if (!connected.served.contains(channel)) {
      on_predecessor_call({name, channel});
    }
  }
  connected.served = {own.begin(), own.end()};
  machine.has_served = machine.has_served || !own.empty();
  machine.note = refused;
  if (machine.refusal.empty()) {
    write_up(machine, own.size(), now);
  }
  values_of(machine).on_up(own, now);
  listener_.on_serve(name, own);
  apply(machine, machine.subscriptions.serve(own), now);
  publish(machine);
}

void Machines::on_predecessor_call(const fabric::ChannelKey& key) {
  const auto left = others_.channels.find(key);
  if (left == others_.channels.end() || std::exchange(left->second.accounted, true)) {
    return;
  }
  const fabric::ChannelStatus& status = left->second.status;
  if (under_way(status)) {
    const auto* other = claims_.of_epoch(key.machine, status.call.epoch);
    listener_.on_predecessor_call(
        status, other != nullptr ? machines::name_of(*other) : others_.predecessors[key.machine]);
  }
}

void Machines::forget_accounted(const std::string& machine, std::optional<std::uint16_t> channel) {
  std::erase_if(others_.channels, [&](const auto& other) {
    return other.second.accounted && other.first.machine == machine &&
           (!channel || other.first.channel == *channel);
  });
}

}  // namespace millrace::gateway::core
