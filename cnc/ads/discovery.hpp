// What is said over UDP 48899 to find controllers, and to have one keep a route. Pure.
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
/// Of a controller with a route file of its own; answers are longer than questions.
inline constexpr std::size_t max_datagram = 4096;

enum class DiscoveryService : std::uint32_t { identify = 1, add_route = 6 };

struct Datagram {
  std::uint32_t invoke_id = 0;
  DiscoveryService service{};
  bool is_response = false;
  Address sender{};
  /// Ids and what they hold; strings end with a NUL.
  std::vector<std::pair<std::uint16_t, Bytes>> tags{};
  bool operator==(const Datagram&) const = default;
};

Bytes encode(const Datagram& datagram);
tl::expected<Datagram, ProtocolError> decode_datagram(BytesView bytes);

/// What a controller says of itself. Texts are in CP1252, as it sends them.
struct Identity {
  NetId net_id;
  std::string name;
  /// "3.1.4024"; empty if it does not say.
  std::string twincat;
  /// "Windows NT 10.0.19041"; empty if it does not say.
  std::string system;
  /// Of its certificate, "AB:CD:…" or as it writes it; empty where there is no Secure ADS.
  std::string fingerprint;
  bool operator==(const Identity&) const = default;
};

Datagram identify_request(std::uint32_t invoke_id);
/// The answer of a server.
Datagram identify_response(const Datagram& request, const Identity& identity);
/// Nothing if this is no answer to an identify request.
std::optional<Identity> identity_of(const Datagram& datagram);

/// A route to a client. The password travels in clear text.
struct RouteRequest {
  NetId net_id;
  /// What the route is called, and where it leads: an IP address or a name.
  std::string name;
  std::string address;
  std::string user;
  std::string password;
  /// Until the controller is restarted.
  bool temporary = false;
  bool operator==(const RouteRequest&) const = default;
};

Datagram encode(std::uint32_t invoke_id, const RouteRequest& route);
/// Nothing if this is no request for a route.
std::optional<RouteRequest> route_request_of(const Datagram& datagram);
Datagram route_response(const Datagram& request, const Identity& identity, ErrorCode status);
/// Nothing if this is no answer to a request for a route.
std::optional<ErrorCode> route_status_of(const Datagram& datagram);

}  // namespace millrace::cnc::ads
