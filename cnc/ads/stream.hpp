// The byte stream of a connection, independent of its transport; Framing interprets the bytes.
//
//   const auto stream = plain_stream(std::move(socket));
//   const auto [error, size] = co_await stream->read_some(asio::buffer(chunk));
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <tuple>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <tl/expected.hpp>

#include "base/messages/message.hpp"
#include "cnc/ads/bytes.hpp"
#include "cnc/ads/frame.hpp"

namespace millrace::cnc::ads {

/// Not thread-safe. One read and one write may be pending at once; both end when the stream is
/// closed, and it must outlive them.
class Stream {
 public:
  using Socket = boost::asio::ip::tcp::socket;
  /// The error, and the number of bytes moved.
  using Moved = std::tuple<boost::system::error_code, std::size_t>;

  virtual ~Stream() = default;

  virtual boost::asio::awaitable<Moved> read_some(boost::asio::mutable_buffer buffer) = 0;
  virtual boost::asio::awaitable<Moved> write_some(boost::asio::const_buffer bytes) = 0;
  /// Sends as much as the socket accepts without waiting; no write may be pending.
  virtual void send_now(BytesView bytes) = 0;
  /// The underlying connection.
  virtual Socket& socket() = 0;
};

/// Sets TCP_NODELAY: a fast response must not wait for a slow one.
std::unique_ptr<Stream> plain_stream(Stream::Socket socket);

/// A stream and its framing.
struct Transport {
  std::shared_ptr<Stream> stream;
  Framing framing = Framing::ams_tcp;
};

/// Plain ADS.
Transport plain_transport(Stream::Socket socket);

// Opens a TCP connection to a host by name, within a deadline that does not depend on the resolver
// or the network.
//
//   auto socket = co_await dial("10.0.0.5", 48898, 3s);
//   if (!socket) …                          // socket.error() is the reason

/// A connected socket, or the reason of the failure, which follows the name of the host.
using Dialled = tl::expected<boost::asio::ip::tcp::socket, base::messages::Message>;

/// Resolves and connects; `timeout` limits both together.
boost::asio::awaitable<Dialled> dial(std::string host, std::uint16_t tcp_port,
                                     std::chrono::milliseconds timeout);

}  // namespace millrace::cnc::ads
