// A point in time as the pure parts are told it: both clocks, read once by whoever owns them.
#pragma once

#include <chrono>

#include "fabric/messages.hpp"

namespace millrace::fabric {

using SteadyTime = std::chrono::steady_clock::time_point;

/// `steady` paces and times out, so that a set wall clock disturbs nothing; `wall` is what people,
/// events and records see.
struct Moment {
  SteadyTime steady{};
  Time wall{};
};

}  // namespace millrace::fabric
