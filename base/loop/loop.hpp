// Additions to the event loop of Boost.Asio: accepting, quiet completion, watchdog.
#pragma once

#include <chrono>
#include <functional>
#include <optional>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "base/program/log.hpp"

namespace millrace::base::loop {

// Accepts the connections of a TCP server.
//
//   co_spawn(executor, accept_each(acceptor, log, [self](tcp::socket socket) { … }), …);

/// Calls `admit` with each connection until the acceptor is closed. A failure, such as no free
/// descriptor, is logged, and accept is tried again after 100 ms. `admit` keeps alive what it
/// needs, the acceptor included.
boost::asio::awaitable<void> accept_each(boost::asio::ip::tcp::acceptor& acceptor, program::Log log,
                                         std::function<void(boost::asio::ip::tcp::socket)> admit);

// Completion token for coroutines of Boost.Asio: an error is a value, not an exception.
//
//   const auto [error, size] = co_await stream.async_read_some(buffer, quietly);

inline constexpr auto quietly = boost::asio::as_tuple(boost::asio::use_awaitable);

// Notifies the supervisor from the process's event loop that the loop runs: a process with a
// blocked loop is restarted (WatchdogSec= of a systemd unit).
//
//   const Watchdog watchdog(io.get_executor());

/// Does nothing without a supervisor's watchdog. Must not outlive the loop.
class Watchdog {
 public:
  explicit Watchdog(const boost::asio::any_io_executor& executor);

 private:
  void tell();

  std::optional<std::chrono::microseconds> period_;
  boost::asio::steady_timer timer_;
};

}  // namespace millrace::base::loop
