// Datagrams on UDP 48899 that find controllers and add routes to them. Pure.
//
//   const Bytes question = encode(identify_request(7));
//   const auto answer = decode_datagram(received);
//   if (const auto found = identity_of(*answer)) …      // its NetId, name, versions, fingerprint
//
// Not documented; after Beckhoff's AdsLib and ads-rs (inferred).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

#include "cnc/ads/address.hpp"
#include "cnc/ads/bytes.hpp"
#include "cnc/ads/frame.hpp"

namespace millrace::cnc::ads {

inline constexpr std::uint16_t discovery_port = 48899;
/// In bytes, for a controller with its own route file; responses are longer than requests.
inline constexpr std::size_t max_datagram = 4096;

enum class DiscoveryService : std::uint32_t { identify = 1, add_route = 6 };

struct Datagram {
  std::uint32_t invoke_id = 0;
  DiscoveryService service{};
  bool is_response = false;
  Address sender{};
  /// Tag ids and their contents; strings end with a NUL.
  std::vector<std::pair<std::uint16_t, Bytes>> tags{};
  bool operator==(const Datagram&) const = default;
};

Bytes encode(const Datagram& datagram);
tl::expected<Datagram, ProtocolError> decode_datagram(BytesView bytes);

/// What a controller reports about itself. Texts are in CP1252, as it sends them.
struct Identity {
  NetId net_id;
  std::string name;
  /// For example "3.1.4024"; empty if the controller does not report it.
  std::string twincat;
  /// For example "Windows NT 10.0.19041"; empty if the controller does not report it.
  std::string system;
  /// Fingerprint of its certificate, "AB:CD:…" or as the controller writes it; empty without Secure
  /// ADS.
  std::string fingerprint;
  bool operator==(const Identity&) const = default;
};

Datagram identify_request(std::uint32_t invoke_id);
/// The response of a server.
Datagram identify_response(const Datagram& request, const Identity& identity);
/// Nullopt if the datagram is not a response to an identify request.
std::optional<Identity> identity_of(const Datagram& datagram);

/// Request for a route to a client. The password is sent in clear text.
struct RouteRequest {
  NetId net_id;
  /// Name of the route, and its target: an IP address or a host name.
  std::string name;
  std::string address;
  std::string user;
  std::string password;
  /// The route lasts until the controller is restarted.
  bool temporary = false;
  bool operator==(const RouteRequest&) const = default;
};

Datagram encode(std::uint32_t invoke_id, const RouteRequest& route);
/// Nullopt if the datagram is not a request for a route.
std::optional<RouteRequest> route_request_of(const Datagram& datagram);
Datagram route_response(const Datagram& request, const Identity& identity, ErrorCode status);
/// Nullopt if the datagram is not a response to a request for a route.
std::optional<ErrorCode> route_status_of(const Datagram& datagram);

}  // namespace millrace::cnc::ads
