// An ADS client: one connection to one controller, plain or Secure ADS, shared by all its AMS
// ports.
//
//   Client client(executor, {.host = "10.0.0.5", .target = *NetId::parse("10.0.0.5.1.1")});
//   if (auto up = co_await client.connect(); !up) …            // up = the first ReadState answered
//   auto state = co_await client.read_write(552, {0x122301, 0x48}, 4, name);
//
// Any number of requests may be pending at once; responses are matched by invoke id, command and
// peer. When the connection closes, everything pending fails at once with link_lost. Nothing is
// ever repeated by the client: whoever owns the meaning of a write decides that.
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
  /// How long one request may take, its wait for room in the window included. A write to a CNC may
  /// need several NC cycles (ISG/402275851.html, documented), so at least 1 s.
  std::chrono::milliseconds timeout{2000};
  std::chrono::milliseconds connect_timeout{3000};
  /// Requests on the wire at once; more wait their turn. Halved for a while when the controller
  /// says that its mailbox or memory is full.
  std::size_t in_flight = 16;
  /// So many timeouts in a row, with nothing heard in between, end the link; 0 = never. TCP alone
  /// notices a controller that was switched off only after minutes.
  std::size_t silent_timeouts = 3;
  /// A frame announced longer than this closes the connection.
  std::size_t max_frame = 4U << 20U;
  /// Secure ADS, to the port of it; otherwise plain ADS.
  std::optional<Security> security{};
  /// How long TLS and TlsConnectInfo may take together.
  std::chrono::milliseconds handshake_timeout{5000};
  /// The AMS port whose ReadState decides that the link is up.
  std::uint16_t probe_port = 552;
};

/// Why connect() failed or a link ended, in words for the operator.
struct LinkError {
  ErrorCode code = ErrorCode::link_down;
  std::string message;
};

/// Everything runs on the one executor it was given; not thread-safe.
class Client {
 public:
  Client(boost::asio::any_io_executor executor, ClientOptions options);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Resolves, connects, and asks for the state of probe_port; up after the first answer. Fails if
  /// already connected. After a failure or a lost link it may be called again. A controller whose
  /// port answers but knows no ReadState counts as up, with state 0.
  boost::asio::awaitable<tl::expected<DeviceState, LinkError>> connect();
  [[nodiscard]] bool up() const;
  /// Called once each time an established link ends, after the pending requests have failed; not
  /// for close().
  void on_down(std::function<void(const LinkError&)> handler);
  /// Closes the connection; pending requests end with link_lost.
  void close();

  boost::asio::awaitable<Result<DeviceInfo>> info(std::uint16_t port);
  boost::asio::awaitable<Result<DeviceState>> state(std::uint16_t port);
  /// The answer may be shorter than `length`, never longer.
  boost::asio::awaitable<Result<Bytes>> read(std::uint16_t port, Index index, std::uint32_t length);
  boost::asio::awaitable<Result<void>> write(std::uint16_t port, Index index, Bytes data);
  boost::asio::awaitable<Result<Bytes>> read_write(std::uint16_t port, Index index,
                                                   std::uint32_t read_length, Bytes data);

  /// Asks to be told of values as they change: all in one sum (0xF085) where the controller grants
  /// that, otherwise one by one, until one is refused for good. The answer to each, its handle, in
  /// their order; those behind a refusal of the service itself share it. `told` may be called
  /// before this returns, and not after unsubscribe() or the end of the link. ADS promises no
  /// delivery.
  boost::asio::awaitable<std::vector<Result<std::uint32_t>>> subscribe(
      std::uint16_t port, std::vector<AddNotificationRequest> wanted, Told told);
  /// Deletes them at the controller, as far as the link lasts; at once nothing more is told of
  /// them.
  boost::asio::awaitable<void> unsubscribe(std::uint16_t port, std::vector<std::uint32_t> handles);

  /// What a client has at a controller that would stay there when its connection is gone, as it
  /// does with a TwinCAT router (inferred from reports).
  struct Belongings {
    std::uint16_t port = 0;
    /// Handles of notifications, and of symbols.
    std::vector<std::uint32_t> notifications{};
    std::vector<std::uint32_t> symbols{};
  };
  /// close(), after having given that back, without waiting for an answer.
  void leave(const Belongings& belongings);

  using Counters = ClientCounters;
  [[nodiscard]] const Counters& counters() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::cnc::ads
