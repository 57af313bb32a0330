// An ADS server, plain or Secure ADS: serves a Device to any number of clients.
//
//   Server server(io.get_executor(), device, {.tcp_port = 0}, log);   // listens from here on
//   ready(fmt::format("on 127.0.0.1:{}", server.tcp_port()));
//   io.run();
//
// A peer that breaks the protocol loses its connection, with a line in the log; the others notice
// nothing. A peer that does not read its answers is not read from either, so that memory is
// bounded; there are so many connections at most, and who leaves his unused gives it back.
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
  /// A frame announced longer than this closes its connection.
  std::size_t max_frame = std::size_t{4} << 20U;
  /// A connection with more unread output than this is not read from.
  std::size_t max_output = std::size_t{1} << 20U;
  /// One more is closed as soon as it is made, with a line in the log.
  std::size_t max_connections = 250;
  /// A connection over which no byte has gone for so long is closed, with a line in the log, unless
  /// its client waits for us: for notifications or an answer that is late. 0 = none is.
  std::chrono::milliseconds idle_time = std::chrono::minutes(10);
  /// A new connection closes the older ones from the same IP address, as a TwinCAT router does it
  /// (inferred from many reports): two clients on one host then throw each other out.
  bool one_connection_per_address = false;
  /// Notifications of a lost connection go on when a client of the same NetId connects again, as
  /// they do with a TwinCAT router (inferred from reports).
  bool notifications_survive = false;
  Faults faults{};
  /// Secure ADS only; otherwise plain ADS only.
  std::optional<ServerSecurity> security{};
  /// The clients that are known, and those to come. Without it Secure ADS knows no certificate;
  /// plain ADS then goes by session.routes alone.
  std::shared_ptr<Routes> routes{};
  /// How long TLS and TlsConnectInfo may take together.
  std::chrono::milliseconds handshake_timeout{10'000};
  SecureFaults secure_faults{};
};

/// Everything, the calls of the Device included, runs on the one executor it was given; not
/// thread-safe.
class Server {
 public:
  /// Throws std::runtime_error with the reason if it cannot listen, or has no use for a key or
  /// certificate. The device must outlive the
  /// server.
  Server(const boost::asio::any_io_executor& executor, Device& device, ServerOptions options,
         base::program::Log log);
  /// Stops.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// The port it listens on.
  [[nodiscard]] std::uint16_t tcp_port() const;
  [[nodiscard]] std::size_t connections() const;
  /// Changes what goes wrong from now on, also for the connections that exist.
  void set_faults(const Faults& faults);
  /// Calls `done` once all that was answered until now has left, with true; with false if that has
  /// not happened within `limit`. Never from within this function, and not after stop().
  void drain(std::chrono::milliseconds limit, std::function<void(bool)> done);
  /// Closes the listening socket and all connections; the device is not called any more.
  void stop();

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::cnc::ads
