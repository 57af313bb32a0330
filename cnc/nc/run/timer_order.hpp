// Executes a #TIMER command, in the decoder or in the interpolator.
#pragma once

#include "cnc/nc/run/block.hpp"
#include "cnc/nc/timers.hpp"

namespace millrace::cnc::nc::run {

/// The order's id must be below Timers::count.
inline void carry_out(const TimerOrder& order, Timers& timers, Duration now) {
  switch (order.action) {
    case syntax::TimerAction::start:
      timers.start(order.id, now);
      break;
    case syntax::TimerAction::stop:
      timers.stop(order.id, now);
      break;
    case syntax::TimerAction::read:
      timers.read(order.id, now);
      break;
    case syntax::TimerAction::clear:
      timers.clear(order.id);
      break;
  }
}

}  // namespace millrace::cnc::nc::run
