// The network of this host as known without sending: its interfaces, and their use by other
// processes.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <netinet/in.h>

namespace millrace::tools::doctor {

/// The multicast discovery of DDS (OMG DDSI-RTPS 2.2, 9.6.1.4, and Cyclone's default ports).
inline constexpr const char* discovery_group = "239.255.0.1";
inline constexpr std::uint32_t first_port = 7400;
inline constexpr std::uint32_t ports_per_domain = 250;
/// Of the first process of a host with its own port; the next ones follow by twos.
inline constexpr std::uint32_t unicast_offset = 10;

/// The UDP port to which participants of a domain announce themselves by multicast.
constexpr std::uint32_t discovery_port(std::uint32_t domain) {
  return first_port + ports_per_domain * domain;
}

/// "10.77.0.3"
std::string address_text(const sockaddr_in& address);

struct Interface {
  std::string name{};
  /// Its IPv4 address; empty if it has none.
  std::string address{};
  bool up = false;
  bool multicast = false;
  bool loopback = false;
  /// False: no cable, or nothing at its other end.
  bool carrier = true;
};

/// All interfaces of this host.
std::vector<Interface> interfaces_here();

/// The DDS domains whose ports are open on this host, from the text of /proc/net/udp. Only up to
/// 100: beyond, ports of any process look like those of a domain.
std::set<std::uint32_t> domains_in(std::string_view proc_net_udp);

/// Interfaces on which programs of this host listen for announcements, from the text of
/// /proc/net/igmp.
std::set<std::string> listening_interfaces_in(std::string_view proc_net_igmp);

/// The whole file, or empty.
std::string read_text(const std::string& file);

// Whether the configured peers can be reached.

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
