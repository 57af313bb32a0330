// What the stages of a channel are given in each tick.
#pragma once

#include <chrono>
#include <functional>

#include "cnc/nc/environment.hpp"
#include "cnc/nc/event.hpp"

namespace millrace::cnc::nc::run {

using Duration = std::chrono::nanoseconds;

struct Tick {
  /// Simulated time to advance to.
  Duration now;
  Environment& environment;
  /// Takes what is told to the outside.
  const std::function<void(Event)>& emit;
};

}  // namespace millrace::cnc::nc::run
