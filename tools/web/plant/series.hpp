// What one number of a machine was over the last minutes: a point where it changed, and how long it
// was known. Pure.
//
//   series.add(at, 12.5, most);
//   series.add(at, Series::unknown, most);             // from then on nobody knows
//
// Between two points it was as the first of them says, since a gateway tells what changes.
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
  /// What is older is forgotten, but for what it was when that time began.
  static constexpr std::chrono::minutes kept{10};
  /// Of what changes faster the lowest, the highest and the last of each such time are kept: what a
  /// plot of some hundred points shows.
  static constexpr std::chrono::milliseconds grain{250};
  static constexpr std::size_t most_in_a_grain = 3;

  /// Of more than `most` points the first ones go. Where the clock went back, what is after `at`
  /// goes.
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
