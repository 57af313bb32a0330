#include "base/loop/loop.hpp"

#include <chrono>

#include <boost/asio/steady_timer.hpp>

#include "base/program/supervisor.hpp"

namespace millrace::base::loop {

namespace asio = boost::asio;

asio::awaitable<void> accept_each(asio::ip::tcp::acceptor& acceptor, program::Log log,
                                  std::function<void(asio::ip::tcp::socket)> admit) {
  constexpr std::chrono::milliseconds pause{100};
  asio::steady_timer timer(acceptor.get_executor());
  while (acceptor.is_open()) {
    auto [error, socket] = co_await acceptor.async_accept(quietly);
    if (!acceptor.is_open()) {
      co_return;
    }
    if (error) {
      log->warn("cannot accept a connection: {}", error.message());
      timer.expires_after(pause);
      co_await timer.async_wait(quietly);
      continue;
    }
    admit(std::move(socket));
  }
}

Watchdog::Watchdog(const boost::asio::any_io_executor& executor)
    : period_(program::watchdog_period()), timer_(executor) {
  if (period_) {
    tell();
  }
}

void Watchdog::tell() {
  program::notify_supervisor("WATCHDOG=1");
  timer_.expires_after(*period_);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      tell();
    }
  });
}

}  // namespace millrace::base::loop
