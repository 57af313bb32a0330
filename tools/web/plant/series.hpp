// One number of a machine over the last minutes: a point for each change, and when it was unknown.
// Pure.
//
//   series.add(at, 12.5, most);
//   series.add(at, Series::unknown, most);             // unknown from then on
//
// A value holds until the next point, since gateways publish changes only.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <limits>

#include "fabric/messages.hpp"

namespace millrace::tools::web::plant {

class Series {
 public:
  struct Point {
    fabric::Time at{};
    /// NaN: not known.
    double value = 0;
  };

  static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  /// Older points are dropped, except the one that holds at the beginning of this time.
  static constexpr std::chrono::minutes kept{10};
  /// Of faster changes only the lowest, the highest and the last value within this time are kept:
  /// as much as a plot of some hundred points shows.
  static constexpr std::chrono::milliseconds grain{250};
  static constexpr std::size_t most_in_a_grain = 3;

  /// Beyond `most` points the oldest are dropped. If the clock was set back, points after `at` are
  /// dropped.
  void add(fabric::Time at, double value, std::size_t most);
  void forget_before(fabric::Time time);
  void shorten_to(std::size_t most);

  [[nodiscard]] const std::deque<Point>& points() const { return points_; }

 private:
  /// Makes room for one more point in the grain of `at`.
  void thin_out(fabric::Time at);

  std::deque<Point> points_;
};

}  // namespace millrace::tools::web::plant
