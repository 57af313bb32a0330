// The clients that a server knows, as the route file of a TwinCAT has them, and what it says to one
// that has shaken hands. Pure.
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
  /// Of the client's certificate; empty for one of plain ADS.
  std::string fingerprint;
  bool operator==(const Route&) const = default;
};

class Routes {
 public:
  /// Replaces what is known of the NetId. Those of more than 1000 are not kept (our choice).
  void add(const Route& route);
  /// Called after each add().
  void on_added(std::function<void(const Route&)> handler) { added_ = std::move(handler); }
  [[nodiscard]] const std::vector<Route>& all() const { return routes_; }
  /// With that fingerprint.
  [[nodiscard]] bool knows(const Route& route) const;

 private:
  std::vector<Route> routes_;
  std::function<void(const Route&)> added_ = [](const Route&) {};
};

/// What TLS says of a client.
struct TlsClient {
  /// Of its certificate; empty if it has a pre-shared key.
  std::string fingerprint;
  std::string common_name{};
  /// Its IP address.
  std::string address{};
};

/// What the TlsConnectInfo of a client gets for an answer. One that asks for a route, and may, is
/// known afterwards.
ConnectError admit(const ConnectInfo& request, const TlsClient& client,
                   const ServerSecurity& security, Routes& routes);

}  // namespace millrace::cnc::ads
