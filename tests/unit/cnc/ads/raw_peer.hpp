// One end of a TCP connection in a test: sends any bytes, receives frames, detects the close.
#pragma once

#include <optional>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>

#include "cnc/ads/frame.hpp"

namespace millrace::cnc::ads {

class RawPeer {
 public:
  explicit RawPeer(boost::asio::ip::tcp::socket socket) : socket_(std::move(socket)) {}

  /// Connects to a port of this host.
  static boost::asio::awaitable<RawPeer> connect(std::uint16_t tcp_port);

  boost::asio::awaitable<void> send(Bytes bytes);
  /// The next frame with its 6-byte header; nullopt once the other end has closed.
  boost::asio::awaitable<std::optional<Bytes>> receive();
  void close() { socket_.close(); }
  boost::asio::ip::tcp::socket& socket() { return socket_; }

 private:
  boost::asio::ip::tcp::socket socket_;
};

/// A listening socket on a free port of this host.
class RawListener {
 public:
  explicit RawListener(const boost::asio::any_io_executor& executor);

  [[nodiscard]] std::uint16_t tcp_port() const { return acceptor_.local_endpoint().port(); }
  boost::asio::awaitable<RawPeer> accept();
  void close() { acceptor_.close(); }
  void listen(std::uint16_t port) {
    acceptor_ = boost::asio::ip::tcp::acceptor(acceptor_.get_executor(),
                                               {boost::asio::ip::address_v4::loopback(), port});
  }

 private:
  boost::asio::ip::tcp::acceptor acceptor_;
};

}  // namespace millrace::cnc::ads
