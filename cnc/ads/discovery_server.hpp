// Answers requests for controllers over UDP, and adds routes for authorized users.
//
//   DiscoveryServer server(io.get_executor(), {.identity = …, .routes = routes}, log);
#pragma once

#include <memory>
#include <string>

#include <boost/asio/any_io_executor.hpp>

#include "base/program/log.hpp"
#include "cnc/ads/discovery.hpp"
#include "cnc/ads/routes.hpp"

namespace millrace::cnc::ads {

struct DiscoveryOptions {
  /// A numeric IP address of this host.
  std::string address = "127.0.0.1";
  /// 0 = any free port.
  std::uint16_t port = discovery_port;
  Identity identity{};
  /// The user who may add a route, in CP1252. Empty: no route can be added.
  std::string user{};
  std::string password{};
  std::shared_ptr<Routes> routes{};
};

/// Runs on the one executor that it was given.
class DiscoveryServer {
 public:
  /// Throws std::runtime_error with the reason if it cannot listen.
  DiscoveryServer(const boost::asio::any_io_executor& executor, DiscoveryOptions options,
                  base::program::Log log);
  ~DiscoveryServer();
  DiscoveryServer(const DiscoveryServer&) = delete;
  DiscoveryServer& operator=(const DiscoveryServer&) = delete;

  /// The port on which it listens.
  [[nodiscard]] std::uint16_t port() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::cnc::ads
