#include "base/loop/watchdog.hpp"

#include "base/program/supervisor.hpp"

namespace millrace::base::loop {

Watchdog::Watchdog(const boost::asio::any_io_executor& executor)
    : period_(program::watchdog_period()), timer_(executor) {
  if (period_) {
    tell();
  }
}

void Watchdog::tell() {
  program::tell_supervisor("WATCHDOG=1");
  timer_.expires_after(*period_);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      tell();
    }
  });
}

}  // namespace millrace::base::loop
