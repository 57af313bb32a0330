// An ADS server, plain or Secure ADS: serves a Device to any number of clients.
//
//   Server server(io.get_executor(), device, {.tcp_port = 0}, log);   // listens from here on
//   ready(fmt::format("on 127.0.0.1:{}", server.tcp_port()));
//   io.run();
//
// The server closes the connection of a peer that violates the protocol, with a log line; other
// connections are not affected. It stops reading from a peer that does not read its responses, so
// that memory is bounded. It limits the number of connections and closes idle ones.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/any_io_executor.hpp>

#include "base/program/log.hpp"
#include "cnc/ads/faults.hpp"
#include "cnc/ads/routes.hpp"
#include "cnc/ads/secure_handshake.hpp"
#include "cnc/ads/session.hpp"

namespace millrace::cnc::ads {

struct ServerOptions {
  /// A numeric IP address of this host.
  std::string address = "127.0.0.1";
  /// 0 = any free port.
  std::uint16_t tcp_port = 48898;
  SessionOptions session{};
  /// In bytes. A frame that announces a longer body closes its connection.
  std::size_t max_frame = std::size_t{4} << 20U;
  /// In bytes. A connection with more unsent output than this is not read from.
  std::size_t max_output = std::size_t{1} << 20U;
  /// A further connection closes the oldest half-open one (without a whole frame, or in its
  /// handshake) of the address that has the most of them, so that no address shuts others out.
  /// Without a half-open one it is closed at once; the log has a line at most every 10 s.
  std::size_t max_connections = 250;
  /// A connection without any byte sent or received for this long is closed, with a log line,
  /// unless its client waits for us: for notifications or a delayed response. 0 = never.
  std::chrono::milliseconds idle_time = std::chrono::minutes(10);
  /// A new connection closes the older ones from the same IP address, as a TwinCAT router does
  /// (inferred from many reports): two clients on one host then disconnect each other.
  bool one_connection_per_address = false;
  /// Notifications of a lost connection continue when a client of the same NetId connects again, as
  /// they do with a TwinCAT router (inferred from reports).
  bool notifications_survive = false;
  Faults faults{};
  /// Secure ADS only; without a value, plain ADS only.
  std::optional<ServerSecurity> security{};
  /// The known clients; clients may be added later. Without it Secure ADS begins without a known
  /// certificate, and plain ADS uses session.routes only.
  std::shared_ptr<Routes> routes{};
  /// Timeout of TLS and TlsConnectInfo together.
  std::chrono::milliseconds handshake_timeout{10'000};
  SecureFaults secure_faults{};
};

/// Runs on the one executor that it was given, including the calls of the Device; not thread-safe.
class Server {
 public:
  /// Throws std::runtime_error with the reason if it cannot listen, or if a key or certificate is
  /// unusable. The device must outlive the server.
  Server(const boost::asio::any_io_executor& executor, Device& device, ServerOptions options,
         base::program::Log log);
  /// Calls stop().
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// The port on which it listens.
  [[nodiscard]] std::uint16_t tcp_port() const;
  [[nodiscard]] std::size_t connections() const;
  /// Calls `done` with true once all responses so far are sent, or with false if that takes longer
  /// than `limit`. Never from within this function, and not after stop().
  void drain(std::chrono::milliseconds limit, std::function<void(bool)> done);
  /// Closes the listening socket and all connections. The device is not called afterwards.
  void stop();

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::cnc::ads
