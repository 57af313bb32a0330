// Which machines and channels are ours, and which another gateway serves.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "gateway/machines/machines_impl.hpp"
#include "gateway/words.hpp"

namespace millrace::gateway::machines {

namespace {

/// How long a gateway listens for others before it serves: discovery takes some 10 ms on a quiet
/// host.
constexpr std::chrono::milliseconds listen_time{300};

/// Whose timer comes later than this is on a busy host, where discovery is late too: it listens on.
constexpr std::chrono::milliseconds most_late{50};

/// But not for ever: a host may always be busy.
constexpr std::chrono::seconds longest_listen{3};

/// May the call have been given to an instance? One that waited may have been given out since, by a
/// gateway that is not heard and not gone. One that ends says of which calls that is not so.
bool under_way(const fabric::ChannelStatus& status) {
  return status.call != fabric::CallId{};
}

}  // namespace

void Machines::Impl::listen(MachineState& one) {
  if (!one.listens) {
    one.listens_since = hands.now().steady;
  }
  one.listens = true;
  one.report.on_down("listening whether another gateway serves this machine", hands.now());
  publish(one);
  hands.after(listen_time, [weak = weak_from_this(), machine = one.settings.name,
                            listening = ++one.listening, due = hands.now().steady + listen_time] {
    const auto self = weak.lock();
    if (!self) {
      return;
    }
    const Moment now = self->hands.now();
    const auto found = self->machines.find(machine);
    if (found == self->machines.end() || found->second.listening != listening) {
      return;
    }
    if (now.steady - due > most_late && now.steady - found->second.listens_since < longest_listen) {
      self->listen(found->second);
    } else {
      self->listened(found->second);
    }
  });
}

void Machines::Impl::listened(MachineState& one) {
  const std::string machine = one.settings.name;
  one.listens = false;
  if (!one.has_served) {
    const auto claimed = claims.behind_those_that_serve(machine, one.report.status().claimed);
    one.report.claim(claimed, one.settings.channels);
  }
  review(machine);
}

bool Machines::Impl::take(const fabric::MachineStatus& status) {
  const std::string who = name_of(status);
  const std::string machine = printable(status.machine);
  switch (claims.set(status)) {
    case Claims::Heard::taken:
      return true;
    case Claims::Heard::implausible:
      complain("implausible", machine,
               fmt::format("{}: {} claims it since a time at which there was no gateway "
                           "(claimed={}); that is not listened to. Who says so is no gateway of "
                           "ours, or speaks out of turn: see docs/trust.md",
                           machine, who, status.claimed.time_since_epoch().count()));
      return false;
    case Claims::Heard::another_controller:
      if (machines.contains(status.machine)) {
        complain("another", machine,
                 fmt::format("{}: {} has a machine of this name too, but of another controller "
                             "({}); both are served, and tools cannot tell them apart: give one "
                             "of them another name",
                             machine, who, printable(status.address)));
      }
      return false;
    case Claims::Heard::full:
      complain("claims", "",
               fmt::format("{} is not listened to, who claims {}: more than {} machines, or {} "
                           "gateways of one, are announced on this fabric",
                           who, machine, Claims::most_machines, Claims::most_gateways));
      return false;
  }
  return true;
}

void Machines::Impl::complain(const std::string& kind, const std::string& about,
                              const std::string& text) {
  if (const auto line = complaints.note(kind, about, text, hands.now().steady)) {
    say(Level::warn, *line);
  }
}

void Machines::Impl::review_soon(const std::string& machine) {
  hands.after({}, [weak = weak_from_this(), machine] {
    if (const auto self = weak.lock()) {
      self->review(machine);
    }
  });
}

void Machines::Impl::review(const std::string& machine) {
  const auto found = machines.find(machine);
  if (found == machines.end() || found->second.listens) {
    return;
  }
  MachineState& one = found->second;
  if (one.leaving && listener.channels_of(machine).empty()) {
    const fabric::MachineStatus last = one.report.status();
    machines.erase(found);
    listener.on_machine_left(last);
    return;
  }
  if (!one.leaving && refused_by_all(one)) {
    // A call whose answer is half written is brought to its end all the same.
    if (listener.channels_of(machine).empty()) {
      drop_link(one, one.refusal);
    } else if (!one.link) {
      connect(one);
    }
    publish(one);
    return;
  }
  if (!one.link) {
    connect(one);
  } else if (one.up) {
    serve(one);
  }
  publish(one);
}

bool Machines::Impl::refused_by_all(MachineState& one) {
  const std::string& name = one.settings.name;
  const auto* other = claims.ahead_of_all(name, one.settings.channels, one.report.status().claimed);
  if (other == nullptr) {
    if (!one.refusal.empty()) {
      say(Level::warn,
          fmt::format("{}: taken over: {} is gone", one.settings.to_string(), predecessors[name]));
      one.refusal.clear();
    }
    return false;
  }
  const std::string refusal =
      fmt::format("{} serves it already; this gateway stands by", name_of(*other));
  if (one.refusal != refusal) {
    one.refusal = refusal;
    say(Level::warn, fmt::format("{}: {}", one.settings.to_string(), refusal));
  }
  for (const std::uint16_t channel : listener.channels_of(name)) {
    refuse(one, channel, refusal);
  }
  one.served.clear();
  one.report.on_down(refusal, hands.now());
  return true;
}

void Machines::Impl::refuse(const MachineState& one, std::uint16_t channel,
                            const std::string& reason) {
  listener.on_refused({one.settings.name, channel}, reason);
}

void Machines::Impl::serve(MachineState& one) {
  const std::string& name = one.settings.name;
  Channels ours;
  std::string refused;
  for (const std::uint16_t channel : one.leaving || !one.refusal.empty() ? Channels{} : one.found) {
    const fabric::ChannelKey key{name, channel};
    const auto* other = claims.ahead(key, one.report.status().claimed);
    if (other == nullptr) {
      ours.push_back(channel);
      continue;
    }
    const std::string reason =
        fmt::format("channel {} is served by {} already", channel, name_of(*other));
    refused += fmt::format("{}{}", refused.empty() ? "" : "; ", reason);
    refuse(one, channel, reason);
  }
  if (!refused.empty() && refused != one.note) {
    say(Level::warn,
        fmt::format("{}: {}; this gateway stands by for it", one.settings.to_string(), refused));
  }
  for (const std::uint16_t channel : ours) {
    if (!one.served.contains(channel)) {
      inherit({name, channel});
    }
  }
  one.served = {ours.begin(), ours.end()};
  one.has_served = one.has_served || !ours.empty();
  one.note = refused;
  if (one.refusal.empty()) {
    one.report.on_up(ours.size(), note_of(one), hands.now());
  }
  listener.on_link_up(name, ours);
  carry_out(one, one.watch.serve(ours));
  publish(one);
}

void Machines::Impl::inherit(const fabric::ChannelKey& key) {
  const auto left = last_seen.extract(key);
  if (!left.empty() && under_way(left.mapped())) {
    const auto* other = claims.of_epoch(key.machine, left.mapped().call.epoch);
    listener.on_inherited(left.mapped(),
                          other != nullptr ? name_of(*other) : predecessors[key.machine]);
  }
}

}  // namespace millrace::gateway::machines
