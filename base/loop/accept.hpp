// Accepts the connections of a TCP server.
//
//   co_spawn(executor, accept_each(acceptor, log, [self](tcp::socket socket) { … }), …);
#pragma once

#include <functional>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>

#include "base/program/log.hpp"

namespace millrace::base::loop {

/// Calls `admit` with each connection until the acceptor is closed. A failure, such as no free
/// descriptor, is logged, and accept is tried again after 100 ms. `admit` keeps alive what it
/// needs, the acceptor included.
boost::asio::awaitable<void> accept_each(boost::asio::ip::tcp::acceptor& acceptor, program::Log log,
                                         std::function<void(boost::asio::ip::tcp::socket)> admit);

}  // namespace millrace::base::loop
