// Whether the configured peers can be reached.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace millrace::tools::doctor {

enum class Reach : std::uint8_t {
  /// The name has no address.
  unknown_name,
  /// This host has no route to the address, or no host has it.
  unreachable,
  /// The host says that no program listens to the domain's ports.
  refused,
  /// No response: a process listens, or a packet filter drops packets.
  silent
};

struct Peer {
  std::string name{};
  std::string address{};
  Reach reach = Reach::silent;
  /// The system's error text.
  std::string detail{};
};

/// Sends an empty packet to the ports at which the first programs of a peer listen, and waits at
/// most a second for what the network says to it.
std::vector<Peer> probe_peers(const std::vector<std::string>& names, std::uint32_t domain);

}  // namespace millrace::tools::doctor
