// A block of words while it is read; only for motion*.cpp.
#pragma once

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "cnc/nc/run/motion.hpp"

namespace millrace::cnc::nc::run {

struct MotionState::Draft {
  std::vector<std::pair<std::size_t, double>> axes;
  std::vector<int> functions;
  std::optional<double> dwell;
  /// I, J and K.
  std::array<std::optional<double>, 3> centre;
  bool has_radius = false;
  bool is_dwell = false;
  bool hold = false;
  BlockEnd end = BlockEnd::none;

  [[nodiscard]] bool has_centre() const { return centre[0] || centre[1] || centre[2]; }
};

}  // namespace millrace::cnc::nc::run
