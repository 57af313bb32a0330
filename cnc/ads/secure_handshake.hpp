// The first steps of a Secure ADS connection, for both sides: TLS, then a TlsConnectInfo each way.
// A time limit applies to all of them; no frame is read before the other side is identified.
//
//   auto transport = co_await connect_securely(std::move(socket), {.security = psk, …});
//   if (!transport) …                          // transport.error() is the reason
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include <boost/asio/awaitable.hpp>
#include <tl/expected.hpp>

#include "base/messages/message.hpp"
#include "cnc/ads/faults.hpp"
#include "cnc/ads/security.hpp"
#include "cnc/ads/stream.hpp"
#include "cnc/ads/tls.hpp"

namespace millrace::cnc::ads {

/// An administrator of the controller, who may add routes there. In CP1252.
struct RouteOwner {
  std::string user;
  std::string password;
};

struct SecureHello {
  Security security;
  /// Our NetId.
  NetId source;
  std::chrono::milliseconds timeout{};
  /// Asks the controller to store a route to us, with our fingerprint. Without it the controller
  /// must know us already.
  std::optional<RouteOwner> add_route{};
};

/// The transport of frames, or the reason of the failure, which follows the name of the host.
/// `opened` is called first, with the connection, which may be closed during the handshake.
boost::asio::awaitable<tl::expected<Transport, base::messages::Message>> connect_securely(
    Stream::Socket socket, SecureHello hello, std::function<void(std::weak_ptr<Stream>)> opened);

/// Reads the fingerprint of a controller's certificate without trusting it: the connection ends
/// before any data is sent. On failure, the error is the reason.
boost::asio::awaitable<tl::expected<std::string, base::messages::Message>> ask_fingerprint(
    Stream::Socket socket, SelfSigned shown, std::chrono::milliseconds timeout);

struct SecureWelcome {
  TlsContext context;
  /// Decides the response to a client.
  std::function<ConnectError(const ConnectInfo&, const TlsPeer&)> admit;
  /// Our NetId.
  NetId source;
  std::chrono::milliseconds timeout{};
  SecureFaults faults{};
  /// Called first, with the connection, which may be closed during the handshake.
  std::function<void(std::weak_ptr<Stream>)> opened = [](const std::weak_ptr<Stream>&) {};
};

struct AcceptedClient {
  Transport transport;
  /// The NetId of the peer.
  NetId client;
};

/// A client and the transport of its frames, or the reason of the refusal, as text for the log.
boost::asio::awaitable<tl::expected<AcceptedClient, std::string>> welcome_securely(
    Stream::Socket socket, SecureWelcome welcome);

}  // namespace millrace::cnc::ads
