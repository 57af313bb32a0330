// Opens a TCP connection to a host by name, within a deadline that does not depend on the resolver
// or the network.
//
//   auto socket = co_await dial("10.0.0.5", 48898, 3s);
//   if (!socket) …                          // socket.error() is the reason
#pragma once

#include <chrono>
#include <string>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <tl/expected.hpp>

namespace millrace::cnc::ads {

/// A connected socket, or the reason of the failure, as text that follows the name of the host.
using Dialled = tl::expected<boost::asio::ip::tcp::socket, std::string>;

/// Resolves and connects; `timeout` limits both together.
boost::asio::awaitable<Dialled> dial(std::string host, std::uint16_t tcp_port,
                                     std::chrono::milliseconds timeout);

}  // namespace millrace::cnc::ads
