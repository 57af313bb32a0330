// The first steps of a Secure ADS connection, of both sides: TLS, then a TlsConnectInfo each way.
// All of it within a time limit; no frame is read before the other side is known.
//
//   auto transport = co_await connect_securely(std::move(socket), {.security = psk, …});
//   if (!transport) …                          // transport.error() says why
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include <boost/asio/awaitable.hpp>
#include <tl/expected.hpp>

#include "cnc/ads/faults.hpp"
#include "cnc/ads/security.hpp"
#include "cnc/ads/stream.hpp"
#include "cnc/ads/tls.hpp"

namespace millrace::cnc::ads {

/// Who may add a route at a controller: an administrator of it. In CP1252.
struct RouteOwner {
  std::string user;
  std::string password;
};

struct SecureHello {
  Security security;
  /// Our own.
  NetId source;
  std::chrono::milliseconds timeout{};
  /// Asks the controller to keep a route to us, with our fingerprint; otherwise it has to know us.
  std::optional<RouteOwner> add_route{};
};

/// What carries frames, or why there is nothing, in words that go behind the name of the host.
/// `opened` is called first, with the connection, which may be closed meanwhile.
boost::asio::awaitable<tl::expected<Transport, std::string>> connect_securely(
    Stream::Socket socket, SecureHello hello, std::function<void(std::weak_ptr<Stream>)> opened);

/// Reads the fingerprint of a controller's certificate without trusting it: the connection ends
/// before anything is sent. The error says why there is none.
boost::asio::awaitable<tl::expected<std::string, std::string>> ask_fingerprint(
    Stream::Socket socket, SelfSigned shown, std::chrono::milliseconds timeout);

struct SecureWelcome {
  TlsContext context;
  /// The answer to a client.
  std::function<ConnectError(const ConnectInfo&, const TlsPeer&)> admit;
  /// Our own.
  NetId source;
  std::chrono::milliseconds timeout{};
  SecureFaults faults{};
};

struct Welcomed {
  Transport transport;
  /// The peer's.
  NetId client;
};

/// A client and what carries its frames, or why it was refused, in words for the log.
boost::asio::awaitable<tl::expected<Welcomed, std::string>> welcome_securely(Stream::Socket socket,
                                                                             SecureWelcome welcome);

}  // namespace millrace::cnc::ads
