// What every TCP server does with those who connect to it.
//
//   co_spawn(executor, accept_each(acceptor, log, [self](tcp::socket socket) { … }), …);
#pragma once

#include <functional>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>

#include "base/program/log.hpp"

namespace millrace::base::loop {

/// Hands over each connection until the acceptor is closed. One that cannot be accepted, as when
/// the system has no descriptor left, is said, and after 100 ms there is another try. `admit` keeps
/// alive what it needs, the acceptor included.
boost::asio::awaitable<void> accept_each(boost::asio::ip::tcp::acceptor& acceptor, program::Log log,
                                         std::function<void(boost::asio::ip::tcp::socket)> admit);

}  // namespace millrace::base::loop
