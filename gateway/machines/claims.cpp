#include "gateway/machines/claims.hpp"

#include <algorithm>
#include <tuple>

#include <fmt/format.h>

#include "gateway/settings/settings.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway::machines {

namespace {

bool covers(const fabric::MachineStatus& gateway, std::uint16_t channel) {
  return gateway.claims.empty() ||
         std::ranges::find(gateway.claims, channel) != gateway.claims.end();
}

/// The NetId of an address as a gateway publishes it; empty if there is none, and for the loopback
/// NetId, which identifies no controller.
std::string net_id_of(const std::string& address) {
  const auto comma = address.rfind(", ");
  if (comma == std::string::npos) {
    return {};
  }
  const auto id = cnc::ads::NetId::parse(address.substr(comma + 2));
  return id && *id != settings::ControllerAddress{}.net_id ? id->to_string() : std::string();
}

}  // namespace

fabric::Time plausible(fabric::Time now) {
  return std::clamp(now, Claims::earliest, Claims::latest);
}

void Claims::set_address(const std::string& machine, const std::string& address) {
  controllers_.insert_or_assign(machine, net_id_of(address));
}

Claims::Accepted Claims::set(const fabric::MachineStatus& status) {
  if (status.gateway == self_) {
    return Accepted::yes;
  }
  if (!fabric::is_plausible_claim(status.claimed)) {
    // Its older sample does not count any more either.
    remove(status.machine, status.gateway);
    return Accepted::implausible;
  }
  const auto known = machines_.find(status.machine);
  // Our machines have room, whatever strangers invent.
  const bool configured = controllers_.contains(status.machine);
  if (known == machines_.end()
          ? !configured && machines_.size() >= most_machines
          : known->second.size() >= most_gateways && !known->second.contains(status.gateway)) {
    return Accepted::full;
  }
  machines_[status.machine].insert_or_assign(status.gateway, status);
  return counts(status) ? Accepted::yes : Accepted::another_controller;
}

bool Claims::counts(const fabric::MachineStatus& gateway) const {
  const auto own = controllers_.find(gateway.machine);
  if (own == controllers_.end() || own->second.empty()) {
    return true;
  }
  const std::string net_id = net_id_of(gateway.address);
  return net_id.empty() || net_id == own->second;
}

bool Claims::is_elsewhere(const std::string& machine, std::uint64_t epoch) const {
  const auto* const gateway = of_epoch(machine, epoch);
  return gateway != nullptr && !counts(*gateway);
}

void Claims::remove(const std::string& machine, const fabric::InstanceId& gateway) {
  if (const auto found = machines_.find(machine); found != machines_.end()) {
    found->second.erase(gateway);
    if (found->second.empty()) {
      machines_.erase(found);
    }
  }
}

const fabric::MachineStatus* Claims::find(const std::string& machine,
                                          const fabric::InstanceId& gateway) const {
  const Gateways& gateways = of(machine);
  const auto found = gateways.find(gateway);
  return found == gateways.end() ? nullptr : &found->second;
}

const fabric::MachineStatus* Claims::of_epoch(const std::string& machine,
                                              std::uint64_t epoch) const {
  for (const auto& [id, gateway] : of(machine)) {
    if (gateway.epoch == epoch) {
      return &gateway;
    }
  }
  return nullptr;
}

const fabric::MachineStatus* Claims::owner_before(const fabric::ChannelKey& key,
                                                  fabric::Time own) const {
  for (const auto& [id, gateway] : of(key.machine)) {
    if (counts(gateway) && before(gateway, own) && covers(gateway, key.channel)) {
      return &gateway;
    }
  }
  return nullptr;
}

const fabric::MachineStatus* Claims::owner_of_all_before(const std::string& machine,
                                                         const std::vector<std::uint16_t>& wanted,
                                                         fabric::Time own) const {
  for (const auto& [id, gateway] : of(machine)) {
    const bool all = gateway.claims.empty() ||
                     (!wanted.empty() && std::ranges::all_of(wanted, [&](std::uint16_t channel) {
                       return covers(gateway, channel);
                     }));
    if (all && counts(gateway) && before(gateway, own)) {
      return &gateway;
    }
  }
  return nullptr;
}

bool Claims::contested(const std::string& machine) const {
  return std::ranges::any_of(of(machine), [&](const auto& claim) { return counts(claim.second); });
}

fabric::Time Claims::after_owners(const std::string& machine, fabric::Time own) const {
  for (const auto& [id, gateway] : of(machine)) {
    if (counts(gateway) && gateway.connected && gateway.claimed >= own) {
      own = std::min(gateway.claimed + std::chrono::nanoseconds(1), latest);
    }
  }
  return own;
}

const Claims::Gateways& Claims::of(const std::string& machine) const {
  static const Gateways none;
  const auto found = machines_.find(machine);
  return found == machines_.end() ? none : found->second;
}

bool Claims::before(const fabric::MachineStatus& other, fabric::Time own) const {
  return std::tie(other.claimed, other.gateway) < std::tie(own, self_);
}

std::string name_of(const fabric::MachineStatus& gateway) {
  return fmt::format("gateway {:012x} (pid {} on {})", gateway.epoch, gateway.pid,
                     printable(gateway.host));
}

}  // namespace millrace::gateway::machines
