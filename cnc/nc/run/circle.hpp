// Circular interpolation, G02 and G03: the arc between two points of a plane.
//
//   auto arc = arc_around({{0, 1}, {0, 0}, {10, 0}, true}, {5, 0}, false);   // a half circle
//   arc->length();          // 15.7
//   arc->at(0.5);           // {5, 5}
//
// IB/tf5200_programming_manual/206089483 (circle), 206551563 (correction of the centre) and
// IB/tccncprogramming/15556764811 (radius), documented.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {

/// In the plane, in mm.
using Point = std::array<double, 2>;

/// G17, G18, G19.
enum class Plane { xy, zx, yz };

/// The main axes of a plane, as indices of the channel's first three axes. Seen from the third
/// axis, an angle grows from the first towards the second.
[[nodiscard]] std::array<std::size_t, 2> axes_of(Plane plane);

struct Arc {
  std::array<std::size_t, 2> axes{};
  Point centre{};
  /// The radii differ by at most the permitted amount; between them the radius changes linearly.
  double begin_radius = 0;
  double end_radius = 0;
  /// In radians; a positive sweep is counterclockwise (G03).
  double begin_angle = 0;
  double sweep = 0;

  /// In mm.
  [[nodiscard]] double length() const;
  /// The point at a fraction of the arc, 0 to 1.
  [[nodiscard]] Point at(double part) const;
  /// Derivative of the position by the fraction; its length is that of the arc.
  [[nodiscard]] Point direction(double part) const;
  /// The extreme points along the axes, for the check of limits.
  [[nodiscard]] std::vector<Point> extremes() const;
};

/// The ends of an arc, and its direction.
struct ArcEnds {
  std::array<std::size_t, 2> axes{};
  Point begin{};
  Point end{};
  bool clockwise = false;
};

/// I, J, K: equal ends make a full circle. `corrected` (G165) shifts the centre to where an arc is
/// possible; otherwise (G164) the radii of both ends must be equal. Faults: 20036 the radius is 0,
/// 20020 the centre is out of range, 21758 the radii differ too much; one without a documented id
/// for a centre that would be shifted too far.
[[nodiscard]] values::Result<Arc> arc_around(const ArcEnds& ends, Point centre, bool corrected);

/// R: the shorter arc for a positive radius, the longer for a negative one. Faults: 20034 the ends
/// are equal, 20036 the radius is 0, 20054 the centre is out of range; one without a documented id
/// if the ends are farther apart than two radii.
[[nodiscard]] values::Result<Arc> arc_of_radius(const ArcEnds& ends, double radius);

}  // namespace millrace::cnc::nc::run
