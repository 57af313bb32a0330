// Notifies the supervisor from the process's event loop that the loop runs: a process with a
// blocked loop is restarted (WatchdogSec= of a systemd unit).
//
//   const Watchdog watchdog(io.get_executor());
#pragma once

#include <chrono>
#include <optional>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

namespace millrace::base::loop {

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
