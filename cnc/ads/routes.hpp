// The clients that a server knows, like the route file of a TwinCAT, and the response to a client
// after its TLS handshake. Pure.
//
//   Routes routes;
//   const auto error = admit(request, peer, security, routes);
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "cnc/ads/connect_info.hpp"
#include "cnc/ads/security.hpp"

namespace millrace::cnc::ads {

struct Route {
  NetId net_id;
  /// Fingerprint of the client's certificate; empty for a client of plain ADS.
  std::string fingerprint;
  bool operator==(const Route&) const = default;
};

class Routes {
 public:
  /// Replaces the route of this NetId. Beyond 1000 routes, new ones are not stored (our choice).
  void add(const Route& route);
  /// Sets the handler that is called after each add().
  void on_added(std::function<void(const Route&)> handler) { added_ = std::move(handler); }
  [[nodiscard]] const std::vector<Route>& all() const { return routes_; }
  /// True if a route with this NetId and fingerprint is stored.
  [[nodiscard]] bool knows(const Route& route) const;

 private:
  std::vector<Route> routes_;
  std::function<void(const Route&)> added_ = [](const Route&) {};
};

/// What TLS knows about a client.
struct TlsClient {
  /// Fingerprint of its certificate; empty if it has a pre-shared key.
  std::string fingerprint;
  std::string common_name{};
  /// Its IP address.
  std::string address{};
};

/// The response to the TlsConnectInfo of a client. Stores a route if the client requests one and is
/// authorized to.
ConnectError admit(const ConnectInfo& request, const TlsClient& client,
                   const ServerSecurity& security, Routes& routes);

}  // namespace millrace::cnc::ads
