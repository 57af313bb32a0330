// The motion of a channel, for observers.
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>

namespace millrace::cnc::nc {

/// Limits of an axis in mm or degrees, and its greatest feed in mm/min.
struct AxisLimits {
  double least = 0;
  double greatest = 0;
  double greatest_feed = std::numeric_limits<double>::infinity();
};

/// State of the interpolator at the last tick. Times and speeds include the time scale.
struct MotionStatus {
  /// Of the current motion, in mm/s and mm; 0 without one.
  double velocity = 0;
  /// The same at an override of 100 %.
  double programmed_velocity = 0;
  double rest_path = 0;
  /// Remaining time of the current dwell.
  std::chrono::nanoseconds dwell_left{0};
  /// Path since the program's start, in mm.
  double path = 0;
  /// Number of blocks that the decoder had read up to the current one; repeated blocks count each
  /// time.
  std::uint64_t blocks = 0;
};

/// Single step: the interpolator stops before blocks; the decoder runs ahead as usual
/// (IB/tf5200_single_step_mode/306132491, 306149899, documented).
struct SingleStep {
  enum class Mode : std::uint32_t {
    into = 0,           // before each block
    over = 1,           // not within subprograms that the last block calls
    out = 2,            // after the end of the last block's subprogram
    to_next_motion = 3  // before each motion
  };
  bool enabled = false;
  Mode mode = Mode::into;
};

}  // namespace millrace::cnc::nc
