// The HTTP server: sockets, TLS, time limits. The site decides what to respond.
//
//   Server server(io.get_executor(), {.port = 0}, site, log);      // listens from here on
//   server.publish("changes", json);                               // to every open stream
//
// Each operation of a connection has a time limit, and the number of connections is limited. If
// there are too many, one that waits for its request is closed: of the address that has the most of
// them, the one that has waited for longest. A browser that does not read is dropped. Other clients
// do not notice.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <boost/asio/any_io_executor.hpp>
#include <tl/expected.hpp>

#include "base/program/log.hpp"
#include "tools/web/http/site.hpp"

namespace millrace::tools::web::live {

struct ServerOptions {
  /// A numeric IP address of this host.
  std::string address = "127.0.0.1";
  /// 0 = any free port.
  std::uint16_t port = 8080;
  /// PEM files of the certificate with its chain, and of its key; empty = plain HTTP.
  std::string certificate{};
  std::string key{};
  /// Their X-Forwarded-For names the client; numeric IP addresses.
  std::set<std::string> trusted_proxies{};
  /// Well below the 1024 descriptors that Cyclone's select() supports.
  std::size_t most_connections = 512;
  /// Browsers with an open event stream.
  std::size_t most_browsers = 256;
  /// From connecting, or from the last response, to the end of a request's header.
  std::chrono::milliseconds time_to_ask = std::chrono::seconds(20);
  /// For the browser to take a part of a response.
  std::chrono::milliseconds time_to_read = std::chrono::seconds(15);
};

/// Counters since its start.
struct ServerCounts {
  std::size_t connections = 0;
  std::size_t browsers = 0;
  std::uint64_t requests = 0;
  std::uint64_t accepted = 0;
  /// Idle connections that were closed for new ones, and new ones that were refused.
  std::uint64_t displaced = 0;
  /// Browsers that did not read their events.
  std::uint64_t dropped = 0;
};

/// Runs on the executor that it is given.
class Server {
 public:
  /// Throws std::runtime_error if it cannot listen, or cannot use the certificate or its key.
  /// `site` outlives the server.
  Server(const boost::asio::any_io_executor& executor, ServerOptions options,
         const http::Site& site, base::program::Log log);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// The first event for a new stream.
  void on_greeting(std::function<std::string()> greeting);
  /// Sends an event (server-sent events) to every stream; `data` has no line break.
  void publish(std::string_view event, std::string_view data);

  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] ServerCounts counts() const;
  /// Reads certificate and key again, for new connections. Returns a message; on an error the old
  /// ones stay in use.
  tl::expected<std::string, std::string> take_certificate();
  /// When its certificate ends; nothing without TLS.
  [[nodiscard]] std::optional<fabric::Time> certificate_ends() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

/// As it goes over the wire.
std::string event_text(std::string_view event, std::string_view data);

}  // namespace millrace::tools::web::live
