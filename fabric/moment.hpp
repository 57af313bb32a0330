// A point in time for the pure parts: both clocks, read once by the caller.
#pragma once

#include <chrono>

#include "fabric/messages.hpp"

namespace millrace::fabric {

using SteadyTime = std::chrono::steady_clock::time_point;

/// `steady` is for periods and timeouts, so that a set wall clock disturbs nothing; `wall` is what
/// people, events and records see.
struct Moment {
  SteadyTime steady{};
  Time wall{};
};

}  // namespace millrace::fabric
