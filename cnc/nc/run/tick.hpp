// The inputs of a channel's stages in each tick.
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
  /// Takes the events.
  const std::function<void(Event)>& emit;
};

}  // namespace millrace::cnc::nc::run
