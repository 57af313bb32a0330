#include "cnc/nc/run/circle.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::display;
using values::fault;
using values::Result;

// Below a hundredth of the kernel's unit of length, 0.1 µm.
constexpr double same_point = 1e-6;
// A centre is a 32-bit number of 0.1 µm (documented by the examples of 20020 and 20054).
constexpr double farthest_centre = 214'748.3647;
// Defaults of P-CHAN-00059 and P-CHAN-00060 (documented); that exceeding either limit is an error
// is inferred.
constexpr double most_shift = 2.0;
constexpr double most_shift_of_radius = 0.05;
// Defaults of P-CHAN-00171 and P-CHAN-00172 (documented); that the larger one applies is inferred.
constexpr double most_difference = 0.005;
constexpr double most_difference_of_radius = 0.001;

double distance(Point from, Point to) {
  return std::hypot(to[0] - from[0], to[1] - from[1]);
}

Point middle(const ArcEnds& ends) {
  return {(ends.begin[0] + ends.end[0]) / 2, (ends.begin[1] + ends.end[1]) / 2};
}

// Also false for NaN.
bool is_in_range(Point centre) {
  return std::abs(centre[0]) <= farthest_centre && std::abs(centre[1]) <= farthest_centre;
}

double angle_of(Point centre, Point point) {
  return std::atan2(point[1] - centre[1], point[0] - centre[0]);
}

Arc arc_between(const ArcEnds& ends, Point centre) {
  Arc arc{ends.axes,
          centre,
          distance(centre, ends.begin),
          distance(centre, ends.end),
          angle_of(centre, ends.begin),
          0};
  constexpr double turn = 2 * std::numbers::pi;
  if (distance(ends.begin, ends.end) < same_point) {
    arc.sweep = ends.clockwise ? -turn : turn;
    return arc;
  }
  const double sweep = angle_of(centre, ends.end) - arc.begin_angle;
  arc.sweep =
      ends.clockwise ? (sweep < 0 ? sweep : sweep - turn) : (sweep > 0 ? sweep : sweep + turn);
  return arc;
}

// The nearest point with the same distance from both ends.
Point equidistant(const ArcEnds& ends, Point centre) {
  const double chord = distance(ends.begin, ends.end);
  if (chord < same_point) {
    return centre;
  }
  const Point along{(ends.end[0] - ends.begin[0]) / chord, (ends.end[1] - ends.begin[1]) / chord};
  const Point from = middle(ends);
  const double off = (centre[0] - from[0]) * along[0] + (centre[1] - from[1]) * along[1];
  return {centre[0] - off * along[0], centre[1] - off * along[1]};
}

}  // namespace

std::array<std::size_t, 2> axes_of(Plane plane) {
  switch (plane) {
    case Plane::zx:
      return {2, 0};
    case Plane::yz:
      return {1, 2};
    default:
      return {0, 1};
  }
}

double Arc::length() const {
  return std::abs(sweep) * (begin_radius + end_radius) / 2;
}

Point Arc::at(double part) const {
  const double radius = begin_radius + (end_radius - begin_radius) * part;
  const double angle = begin_angle + sweep * part;
  return {centre[0] + radius * std::cos(angle), centre[1] + radius * std::sin(angle)};
}

Point Arc::direction(double part) const {
  const double radius = begin_radius + (end_radius - begin_radius) * part;
  const double angle = begin_angle + sweep * part;
  return {-radius * sweep * std::sin(angle), radius * sweep * std::cos(angle)};
}

std::vector<Point> Arc::extremes() const {
  constexpr double quarter = std::numbers::pi / 2;
  const double from = std::min(begin_angle, begin_angle + sweep);
  const double to = std::max(begin_angle, begin_angle + sweep);
  std::vector<Point> points;
  const auto last = static_cast<int>(std::floor(to / quarter));
  for (auto i = static_cast<int>(std::ceil(from / quarter)); i <= last; ++i) {
    points.push_back(at((i * quarter - begin_angle) / sweep));
  }
  return points;
}

Result<Arc> arc_around(const ArcEnds& ends, Point centre, bool corrected) {
  if (!is_in_range(centre)) {
    return fault(20020, "the centre of the circle is out of range");
  }
  const Point used = corrected ? equidistant(ends, centre) : centre;
  const Arc arc = arc_between(ends, used);
  if (arc.begin_radius < same_point || arc.end_radius < same_point) {
    return fault(20036, "the radius of the circle is 0; program its centre with I, J and K");
  }
  const double shift = distance(centre, used);
  if (shift > std::min(most_shift, most_shift_of_radius * arc.begin_radius)) {
    return fault(0, "the centre of the circle would have to be shifted by " + display(shift) +
                        " mm to reach its end; at most 2 mm and 5 % of the radius are allowed");
  }
  const double difference = std::abs(arc.begin_radius - arc.end_radius);
  if (difference > std::max(most_difference, most_difference_of_radius * arc.begin_radius)) {
    return fault(21758, "the radii at the beginning and the end of the circle differ by " +
                            display(difference) + " mm");
  }
  return arc;
}

Result<Arc> arc_of_radius(const ArcEnds& ends, double radius) {
  const double chord = distance(ends.begin, ends.end);
  if (chord < same_point) {
    return fault(20034, "a full circle cannot be programmed with R; use I, J and K");
  }
  if (std::abs(radius) < same_point) {
    return fault(20036, "the radius of the circle is 0");
  }
  const double half = chord / 2;
  if (half > std::abs(radius) + same_point) {
    return fault(0, "the radius R" + display(radius) + " is too small for ends that are " +
                        display(chord) + " mm apart");
  }
  const double height = std::sqrt(std::max(radius * radius - half * half, 0.0));
  // The centre of a short counterclockwise arc is on the left of the line from begin to end.
  const double side = (radius > 0) == ends.clockwise ? -height : height;
  const Point from = middle(ends);
  const Point centre{from[0] - side * (ends.end[1] - ends.begin[1]) / chord,
                     from[1] + side * (ends.end[0] - ends.begin[0]) / chord};
  if (!is_in_range(centre)) {
    return fault(20054, "the centre of the circle of R" + display(radius) + " is out of range");
  }
  return arc_between(ends, centre);
}

}  // namespace millrace::cnc::nc::run
