// Wakes the core at the time that it requested (core::Host::wake_at).
//
//   WakeTimer timer(executor, [&core] { core.on_time(); });
//   timer.set(time);
#pragma once

#include <functional>
#include <optional>
#include <utility>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

#include "gateway/moment.hpp"

namespace millrace::gateway::shell {

class WakeTimer {
 public:
  WakeTimer(const boost::asio::any_io_executor& executor, std::function<void()> on_time)
      : timer_(executor), on_time_(std::move(on_time)) {}

  /// An earlier time than requested is kept: an early wake-up costs less than to move the timer.
  void set(std::optional<SteadyTime> time) {
    if (!time || (set_for_ && *set_for_ <= *time)) {
      return;
    }
    set_for_ = time;
    timer_.expires_at(*time);
    timer_.async_wait([this](boost::system::error_code error) {
      if (!error) {
        set_for_.reset();
        on_time_();
      }
    });
  }

 private:
  boost::asio::steady_timer timer_;
  std::function<void()> on_time_;
  std::optional<SteadyTime> set_for_;
};

}  // namespace millrace::gateway::shell
