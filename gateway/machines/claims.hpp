// The owner of a channel when several gateways are configured for it: the one that claimed it
// first. Pure: takes the samples of gateways and rejects impossible ones.
//
//   Claims claims(our_id);
//   claims.set(status);                               // another gateway's millrace/machine
//   if (const auto* other = claims.owner_before({"cnc", 1}, our_claim)) …      // until it is gone
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "fabric/messages.hpp"

namespace millrace::gateway::machines {

class Claims {
 public:
  static constexpr fabric::Time earliest = fabric::earliest_claim;
  static constexpr fabric::Time latest = fabric::latest_claim;
  /// Machines of a fabric, and gateways of one of them: far more than there are.
  static constexpr std::size_t most_machines = 1024;
  static constexpr std::size_t most_gateways = 64;

  /// Samples of `self` are ignored.
  explicit Claims(const fabric::InstanceId& self) : self_(self) {}

  /// Our machine of this name is the controller at this address ("HOST:PORT, NETID"). A gateway
  /// that claims the name at another AMS NetId means another controller: it does not affect ours.
  void set_address(const std::string& machine, const std::string& address);

  enum class Accepted : std::uint8_t {
    yes,
    /// The claim has an impossible time. Ignored.
    implausible,
    /// Another controller has the name of one of ours. Stored, without effect on ours.
    another_controller,
    /// There are too many. Ignored.
    full
  };
  Accepted set(const fabric::MachineStatus& status);
  void remove(const std::string& machine, const fabric::InstanceId& gateway);

  /// The last sample of another gateway about the machine; nullptr if there is none.
  [[nodiscard]] const fabric::MachineStatus* find(const std::string& machine,
                                                  const fabric::InstanceId& gateway) const;
  /// The gateway whose calls carry this epoch, if it claims channels of the machine; else nullptr.
  [[nodiscard]] const fabric::MachineStatus* of_epoch(const std::string& machine,
                                                      std::uint64_t epoch) const;
  /// The gateway whose claim to this channel comes before ours of time `ours`; nullptr if none.
  [[nodiscard]] const fabric::MachineStatus* owner_before(const fabric::ChannelKey& key,
                                                          fabric::Time own) const;
  /// The gateway whose claim comes before ours for all channels that we want (none = all that the
  /// controller has), so that we need not even connect; nullptr if none.
  [[nodiscard]] const fabric::MachineStatus* owner_of_all_before(
      const std::string& machine, const std::vector<std::uint16_t>& wanted, fabric::Time own) const;
  /// Whether the calls of this epoch belong to another controller with the machine's name.
  [[nodiscard]] bool is_elsewhere(const std::string& machine, std::uint64_t epoch) const;
  /// Whether any other gateway claims channels of this machine.
  [[nodiscard]] bool contested(const std::string& machine) const;
  /// Whether the other gateway's claim comes before ours of time `ours`.
  [[nodiscard]] bool before(const fabric::MachineStatus& other, fabric::Time own) const;
  /// `ours`, or a moment after the claims of those that serve the machine already: clocks of hosts
  /// differ, and a later gateway must not come before them.
  [[nodiscard]] fabric::Time after_owners(const std::string& machine, fabric::Time own) const;

 private:
  using Gateways = std::map<fabric::InstanceId, fabric::MachineStatus>;
  [[nodiscard]] const Gateways& of(const std::string& machine) const;
  /// Whether it means our controller of that name.
  [[nodiscard]] bool counts(const fabric::MachineStatus& gateway) const;

  fabric::InstanceId self_;
  std::map<std::string, Gateways> machines_;
  /// Of our machines, by name: the NetId.
  std::map<std::string, std::string> controllers_;
};

/// The time of a new claim of ours, within the limits even if our clock is wrong.
fabric::Time plausible(fabric::Time now);

/// "gateway 5f3a9c0112d4 (pid 4711 on host7)": its epoch, which its call ids carry.
std::string name_of(const fabric::MachineStatus& gateway);

}  // namespace millrace::gateway::machines
