#include "gateway/machines/claims.hpp"

#include <algorithm>
#include <tuple>

#include <fmt/format.h>

#include "gateway/words.hpp"

namespace millrace::gateway::machines {

namespace {

bool covers(const fabric::MachineStatus& gateway, std::uint16_t channel) {
  return gateway.claims.empty() ||
         std::ranges::find(gateway.claims, channel) != gateway.claims.end();
}

}  // namespace

void Claims::set(const fabric::MachineStatus& status) {
  if (status.gateway != self_) {
    machines_[status.machine].insert_or_assign(status.gateway, status);
  }
}

void Claims::remove(const std::string& machine, const fabric::InstanceId& gateway) {
  if (const auto found = machines_.find(machine); found != machines_.end()) {
    found->second.erase(gateway);
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

const fabric::MachineStatus* Claims::ahead(const fabric::ChannelKey& key, fabric::Time ours) const {
  for (const auto& [id, gateway] : of(key.machine)) {
    if (before(gateway, ours) && covers(gateway, key.channel)) {
      return &gateway;
    }
  }
  return nullptr;
}

const fabric::MachineStatus* Claims::ahead_of_all(const std::string& machine,
                                                  const std::vector<std::uint16_t>& wanted,
                                                  fabric::Time ours) const {
  for (const auto& [id, gateway] : of(machine)) {
    const bool all = gateway.claims.empty() ||
                     (!wanted.empty() && std::ranges::all_of(wanted, [&](std::uint16_t channel) {
                       return covers(gateway, channel);
                     }));
    if (all && before(gateway, ours)) {
      return &gateway;
    }
  }
  return nullptr;
}

bool Claims::contested(const std::string& machine) const {
  return !of(machine).empty();
}

fabric::Time Claims::behind_those_that_serve(const std::string& machine, fabric::Time ours) const {
  for (const auto& [id, gateway] : of(machine)) {
    if (gateway.connected && gateway.claimed >= ours) {
      ours = gateway.claimed + std::chrono::nanoseconds(1);
    }
  }
  return ours;
}

const Claims::Gateways& Claims::of(const std::string& machine) const {
  static const Gateways none;
  const auto found = machines_.find(machine);
  return found == machines_.end() ? none : found->second;
}

bool Claims::before(const fabric::MachineStatus& other, fabric::Time ours) const {
  return std::tie(other.claimed, other.gateway) < std::tie(ours, self_);
}

std::string name_of(const fabric::MachineStatus& gateway) {
  return fmt::format("gateway {:012x} (pid {} on {})", gateway.epoch, gateway.pid,
                     printable(gateway.host));
}

}  // namespace millrace::gateway::machines
