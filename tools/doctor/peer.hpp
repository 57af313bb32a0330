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
  /// The host reports that no process listens on the domain's ports.
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

/// Sends an empty packet to the ports of a peer's first processes, and waits at most a second for
/// the network's response.
std::vector<Peer> probe_peers(const std::vector<std::string>& names, std::uint32_t domain);

}  // namespace millrace::tools::doctor
