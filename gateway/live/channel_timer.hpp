// The timer of a channel.
//
//   timer.set(at, [this, key] { carry_out(control.on_wake(key, now())); });
//
// It may ring too early: a channel that is asked for later than it was going to be is left to ring
// and asks again then. A call moves its channel's next look several times, and to move a timer
// costs more than to ring once in a while.
#pragma once

#include <memory>
#include <utility>

#include <boost/asio/steady_timer.hpp>

#include "gateway/moment.hpp"

namespace millrace::gateway::live {

/// Its end silences it, also if its time has come already and only its turn has not.
class ChannelTimer {
 public:
  explicit ChannelTimer(const boost::asio::any_io_executor& executor) : timer_(executor) {}

  /// Calls `ring` at this time or before, on the executor.
  template <typename Ring>
  void set(SteadyTime at, Ring ring) {
    if (*at_ <= at) {
      return;
    }
    *at_ = at;
    timer_.expires_at(at);
    timer_.async_wait(
        [due = std::weak_ptr(at_), ring = std::move(ring)](boost::system::error_code error) {
          const auto alive = error ? nullptr : due.lock();
          if (alive) {
            *alive = never;
            ring();
          }
        });
  }

 private:
  static constexpr SteadyTime never = SteadyTime::max();

  boost::asio::steady_timer timer_;
  std::shared_ptr<SteadyTime> at_ = std::make_shared<SteadyTime>(never);
};

}  // namespace millrace::gateway::live
