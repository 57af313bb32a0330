// Ownership of machines and channels among gateways.
#include <algorithm>
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

/// But not for ever: a host may always be busy.
constexpr std::chrono::seconds longest_listen{3};

/// May the call have been dispatched to an instance? One that waited may have been dispatched
/// since, by a gateway that is not received and not gone. A gateway that ends publishes of which
/// calls that is not so.
bool under_way(const fabric::ChannelStatus& status) {
  return status.call != fabric::CallId{};
}

}  // namespace

void Machines::listen(Machine& one, Moment now) {
  const SteadyTime since = one.listening() != nullptr ? one.listening()->since : now.steady;
  const SteadyTime until = now.steady + listen_time;
  one.phase = Machine::Listening{since, until};
  wake_at(until);
  one.status_writer.on_down(base::messages::looks_for_other_gateway(), now);
  publish(one);
}

void Machines::listened(Machine& one, Moment now) {
  const Machine::Listening& listening = *one.listening();
  if (now.steady - listening.until > most_late && now.steady - listening.since < longest_listen) {
    listen(one, now);
    return;
  }
  const std::string machine = one.settings.name;
  one.phase = Machine::StandingBy{};
  if (!one.has_served) {
    const auto claimed = claims_.after_owners(machine, one.status_writer.status().claimed);
    one.status_writer.claim(claimed, one.settings.channels);
  }
  review(machine, now);
}

bool Machines::consider(const fabric::MachineStatus& status, Moment now) {
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
  Machine& one = found->second;
  if (one.removed && listener_.channels_of(machine).empty()) {
    fabric::MachineStatus last = one.status_writer.status();
    last.reason = base::messages::machine_removed();
    machines_.erase(found);
    fabric_.dispose(last);
    return;
  }
  if (!one.removed && owned_by_others(one, now)) {
    // A call with a half-written response is completed in any case.
    if (listener_.channels_of(machine).empty()) {
      drop_link(one, one.refusal, now);
    } else if (one.connected() == nullptr) {
      connect(one, now);
    }
    publish(one);
    return;
  }
  if (one.connected() == nullptr) {
    connect(one, now);
  } else if (one.connected()->found) {
    serve(one, now);
  }
  publish(one);
}

bool Machines::owned_by_others(Machine& one, Moment now) {
  const std::string& name = one.settings.name;
  const auto* other =
      claims_.owner_of_all_before(name, one.settings.channels, one.status_writer.status().claimed);
  if (other == nullptr) {
    if (!one.refusal.empty()) {
      host_.log(Level::warn, fmt::format("{}: taken over: {} is gone", one.settings.to_string(),
                                         predecessors_[name]));
      one.refusal.clear();
    }
    return false;
  }
  const fabric::Message refusal = base::messages::stands_by(machines::name_of(*other));
  if (one.refusal != refusal) {
    one.refusal = refusal;
    host_.log(Level::warn, fmt::format("{}: {}", one.settings.to_string(), refusal));
  }
  for (const std::uint16_t channel : listener_.channels_of(name)) {
    not_owner(one, channel, refusal, now);
  }
  if (auto* const connected = one.connected()) {
    connected->served.clear();
  }
  forget_accounted(name);
  one.status_writer.on_down(refusal, now);
  return true;
}

void Machines::serve(Machine& one, Moment now) {
  const std::string& name = one.settings.name;
  Machine::Connected& connected = std::get<Machine::Connected>(one.phase);
  Channels ours;
  fabric::Message refused;
  for (const std::uint16_t channel :
       one.removed || !one.refusal.empty() ? Channels{} : *connected.found) {
    const fabric::ChannelKey key{name, channel};
    const auto* other = claims_.owner_before(key, one.status_writer.status().claimed);
    if (other == nullptr) {
      ours.push_back(channel);
      continue;
    }
    const fabric::Message reason =
        base::messages::channel_served(channel, machines::name_of(*other));
    refused = refused.empty() ? reason : base::messages::and_also(refused, reason);
    not_owner(one, channel, reason, now);
  }
  if (!refused.empty() && refused != one.note) {
    host_.log(Level::warn, fmt::format("{}: {}; this gateway stands by for it",
                                       one.settings.to_string(), refused));
  }
  for (const std::uint16_t channel : ours) {
    if (!connected.served.contains(channel)) {
      on_predecessor_call({name, channel});
    }
  }
  connected.served = {ours.begin(), ours.end()};
  one.has_served = one.has_served || !ours.empty();
  one.note = refused;
  if (one.refusal.empty()) {
    write_up(one, ours.size(), now);
  }
  values_of(one).on_up(ours, now);
  listener_.on_serve(name, ours);
  apply(one, one.subscriptions.serve(ours), now);
  publish(one);
}

void Machines::on_predecessor_call(const fabric::ChannelKey& key) {
  const auto left = last_seen_.find(key);
  if (left == last_seen_.end() || std::exchange(left->second.accounted, true)) {
    return;
  }
  const fabric::ChannelStatus& status = left->second.status;
  if (under_way(status)) {
    const auto* other = claims_.of_epoch(key.machine, status.call.epoch);
    listener_.on_predecessor_call(
        status, other != nullptr ? machines::name_of(*other) : predecessors_[key.machine]);
  }
}

void Machines::forget_accounted(const std::string& machine, std::optional<std::uint16_t> channel) {
  std::erase_if(last_seen_, [&](const auto& other) {
    return other.second.accounted && other.first.machine == machine &&
           (!channel || other.first.channel == *channel);
  });
}

}  // namespace millrace::gateway::core
