#include "idl/program/watchdog.hpp"

#include "idl/program/supervisor.hpp"

namespace millrace::idl::program {

Watchdog::Watchdog(const boost::asio::any_io_executor& executor)
    : period_(watchdog_period()), timer_(executor) {
  if (period_) {
    tell();
  }
}

void Watchdog::tell() {
  tell_supervisor("WATCHDOG=1");
  timer_.expires_after(*period_);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      tell();
    }
  });
}

}  // namespace millrace::idl::program
