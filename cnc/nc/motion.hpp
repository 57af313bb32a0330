// The motion of a channel as one sees it from outside.
#pragma once

#include <chrono>
#include <cstdint>

namespace millrace::cnc::nc {

/// Where an axis may go, in mm or degrees.
struct AxisLimits {
  double least = 0;
  double greatest = 0;
};

/// What the interpolator does at the time of the last tick. With a time scale, times and speeds are
/// those one sees.
struct MotionStatus {
  /// Of the motion in execution, in mm/s and mm; 0 if there is none.
  double velocity = 0;
  double rest_path = 0;
  /// Of a dwell in execution.
  std::chrono::nanoseconds dwell_left{0};
  /// Since the program's start: the path in mm, and what was begun: motions, dwells, M functions
  /// and the like.
  double path = 0;
  std::uint64_t blocks = 0;
};

}  // namespace millrace::cnc::nc
