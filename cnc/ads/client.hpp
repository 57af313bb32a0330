// An ADS client: one connection to one controller, plain or Secure ADS, shared by all its AMS
// ports.
//
//   Client client(executor, {.host = "10.0.0.5", .target = *NetId::parse("10.0.0.5.1.1")});
//   if (auto up = co_await client.connect(); !up) …            // up = the first ReadState response
//   auto state = co_await client.read_write(552, {0x122301, 0x48}, 4, name);
//
// Any number of requests may be pending at once. The client matches responses by invoke id, command
// and peer. When the connection closes, all pending requests fail at once with link_lost. The
// client never repeats a request: its caller decides whether a write may be repeated.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include "base/messages/message.hpp"
#include "cnc/ads/exchange.hpp"
#include "cnc/ads/notification_inbox.hpp"
#include "cnc/ads/request.hpp"
#include "cnc/ads/security.hpp"

namespace millrace::cnc::ads {

struct ClientOptions {
  std::string host = "127.0.0.1";
  std::uint16_t tcp_port = 48898;
  /// The controller's NetId.
  NetId target{};
  /// Our own address; the controller needs a route to this NetId.
  Address source{{{127, 0, 0, 1, 2, 1}}, 32750};
  /// Timeout of one request, including its wait for room in the window. A write to a CNC may need
  /// several NC cycles (ISG/402275851.html, documented), so use at least 1 s. A request that times
  /// out ends the connection if no other request was answered since it was made, or none in time
  /// for three times this (our choice): TCP alone detects a controller that was switched off only
  /// after minutes, and a path that sends frames but answers nothing never. The connection also
  /// ends when the router has delivered no request to probe_port for this time.
  std::chrono::milliseconds timeout{2000};
  std::chrono::milliseconds connect_timeout{3000};
  /// The most requests on the wire at once; further requests wait. The client halves the window for
  /// a while when the controller reports a full mailbox or memory.
  std::size_t in_flight = 32;
  /// In bytes. A frame that announces a longer body closes the connection.
  std::size_t max_frame = 4U << 20U;
  /// Uses Secure ADS on tcp_port; without a value, plain ADS.
  std::optional<Security> security{};
  /// Timeout of TLS and TlsConnectInfo together.
  std::chrono::milliseconds handshake_timeout{5000};
  /// The AMS port whose ReadState response shows that the connection is up.
  std::uint16_t probe_port = 552;
};

/// Why connect() failed or a connection ended, for the operator.
struct LinkError {
  ErrorCode code = ErrorCode::link_down;
  base::messages::Message message{};
  /// How long the controller has answered nothing, if the connection ended because of that.
  std::chrono::nanoseconds silent_for{};
};

/// Runs on the one executor that it was given; not thread-safe.
class Client {
 public:
  Client(boost::asio::any_io_executor executor, ClientOptions options);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Resolves the host, connects, and reads the state of probe_port; up after the first response.
  /// Fails if the client is connected or connecting. It may be called again after a failure or a
  /// lost connection. A controller whose port responds but does not support ReadState counts as up,
  /// with state 0.
  boost::asio::awaitable<tl::expected<DeviceState, LinkError>> connect();
  [[nodiscard]] bool up() const;
  /// Sets the handler that is called once each time an established connection ends, after the
  /// pending requests have failed; not after close().
  void on_down(std::function<void(const LinkError&)> handler);
  /// Closes the connection; pending requests end with link_lost.
  void close();

  boost::asio::awaitable<Result<DeviceInfo>> info(std::uint16_t port);
  boost::asio::awaitable<Result<DeviceState>> state(std::uint16_t port);
  /// The response may be shorter than `length`, never longer.
  boost::asio::awaitable<Result<Bytes>> read(std::uint16_t port, Index index, std::uint32_t length);
  boost::asio::awaitable<Result<void>> write(std::uint16_t port, Index index, Bytes data);
  boost::asio::awaitable<Result<Bytes>> read_write(std::uint16_t port, Index index,
                                                   std::uint32_t read_length, Bytes data);

  /// Subscribes to values: all in one sum request (0xF085) where the controller supports it,
  /// otherwise one by one until one is refused for good. Returns the handle or the error of each,
  /// in their order; the requests after a refusal of the service itself get the same error.
  /// `handler` may be called before this returns, and is not called after unsubscribe() or the end
  /// of the connection. ADS does not guarantee delivery.
  boost::asio::awaitable<std::vector<Result<std::uint32_t>>> subscribe(
      std::uint16_t port, std::vector<AddNotificationRequest> wanted, NotificationHandler handler);
  /// Deletes the subscriptions at the controller while the connection lasts. Their handler is not
  /// called from now on.
  boost::asio::awaitable<void> unsubscribe(std::uint16_t port, std::vector<std::uint32_t> handles);

  /// Resources of a client at a controller. They would remain there after the end of the
  /// connection, as they do with a TwinCAT router (inferred from reports).
  struct Resources {
    std::uint16_t port = 0;
    /// Handles of notifications, and of symbols.
    std::vector<std::uint32_t> notifications{};
    std::vector<std::uint32_t> symbols{};
  };
  /// Like close(), but first sends the requests that release these resources, without waiting for
  /// their responses. Blocks for at most 50 ms.
  void leave(const Resources& belongings);

  using Counters = ClientCounters;
  [[nodiscard]] const Counters& counters() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::cnc::ads
