// The HTTP server: sockets, TLS, time limits. What is answered is the site's to say.
//
//   Server server(io.get_executor(), {.port = 0}, site, log);      // listens from here on
//   server.publish("changes", json);                               // to every browser that stays
//
// Each connection has a time for each thing it does, and there is a number of them; who is idle for
// longest makes room for who is new. A browser that does not read is dropped. Nothing of that is
// noticed by anybody else.
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
  /// Well below the 1024 descriptors that Cyclone's select() knows.
  std::size_t most_connections = 512;
  /// Browsers that stay to be told what changes.
  std::size_t most_browsers = 256;
  /// From connecting, or from the last answer, to the end of a request's header.
  std::chrono::milliseconds time_to_ask = std::chrono::seconds(20);
  /// For a part of an answer to be taken.
  std::chrono::milliseconds time_to_read = std::chrono::seconds(15);
};

/// What it has seen since it started.
struct ServerCounts {
  std::size_t connections = 0;
  std::size_t browsers = 0;
  std::uint64_t requests = 0;
  std::uint64_t accepted = 0;
  /// Idle ones that made room, and new ones that found none.
  std::uint64_t displaced = 0;
  /// Browsers that did not read what they were told.
  std::uint64_t dropped = 0;
};

/// Runs on the one executor it was given.
class Server {
 public:
  /// Throws std::runtime_error if it cannot listen, or the certificate or key cannot be used.
  /// `site` outlives the server.
  Server(const boost::asio::any_io_executor& executor, ServerOptions options,
         const http::Site& site, base::program::Log log);
  /// Ends every connection.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// The event that a browser that stays is told first.
  void on_greeting(std::function<std::string()> greeting);
  /// An event (server-sent events) for every browser that stays; `data` has no line break.
  void publish(std::string_view event, std::string_view data);

  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] ServerCounts counts() const;
  /// Reads certificate and key anew, for connections that come from now on. What was done, in
  /// words; or why it is not possible, and the ones before stay.
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
