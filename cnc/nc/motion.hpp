// The motion of a channel as one sees it from outside.
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>

namespace millrace::cnc::nc {

/// Where an axis may go, in mm or degrees, and how fast, in mm/min.
struct AxisLimits {
  double least = 0;
  double greatest = 0;
  double greatest_feed = std::numeric_limits<double>::infinity();
};

/// What the interpolator does at the time of the last tick. With a time scale, times and speeds are
/// those one sees.
struct MotionStatus {
  /// Of the motion in execution, in mm/s and mm; 0 if there is none.
  double velocity = 0;
  /// The same at an override of 100 %.
  double programmed_velocity = 0;
  double rest_path = 0;
  /// Of a dwell in execution.
  std::chrono::nanoseconds dwell_left{0};
  /// Since the program's start, in mm.
  double path = 0;
  /// Blocks the decoder had read when it came to the one in execution, repeated ones each time.
  std::uint64_t blocks = 0;
};

/// Single step: the interpolator stops before blocks; the decoder runs ahead as always
/// (IB/tf5200_single_step_mode/306132491, 306149899, documented).
struct SingleStep {
  enum class Mode : std::uint32_t {
    into = 0,           // before each block
    over = 1,           // not in the subprograms that the last one calls
    out = 2,            // behind the end of the last one's subprogram
    to_next_motion = 3  // before each motion
  };
  bool enabled = false;
  Mode mode = Mode::into;
};

}  // namespace millrace::cnc::nc
