// Lines and circles: the target of a block, whether it can be reached, and the duration.
#include <cmath>

#include "cnc/nc/run/motion.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {

using values::fail;
using values::must;

double path_length(const std::vector<double>& from, const std::vector<double>& to) {
  double square = 0;
  for (std::size_t axis = 0; axis < from.size(); ++axis) {
    square += (to[axis] - from[axis]) * (to[axis] - from[axis]);
  }
  return std::sqrt(square);
}

void MotionState::check_limits(const std::vector<double>& target) const {
  for (std::size_t axis = 0; axis < std::min(target.size(), options_.limits.size()); ++axis) {
    const double least = options_.limits[axis].least;
    const double greatest = options_.limits[axis].greatest;
    const bool inside = target[axis] >= least && target[axis] <= greatest;
    if (!inside) {
      fail(0, "axis " + options_.axes[axis] + " would leave its limits, " + values::display(least) +
                  " to " + values::display(greatest) + ", for " + values::display(target[axis]));
    }
  }
}

void MotionState::check_limits(const std::vector<double>& target, const Arc& arc) const {
  for (const Point& extreme : arc.extremes()) {
    std::vector<double> position = target;
    position[arc.axes[0]] = extreme[0];
    position[arc.axes[1]] = extreme[1];
    check_limits(position);
  }
}

// On an arc, an axis is never faster than the path.
double MotionState::least_time(const std::vector<double>& target,
                               const std::optional<Arc>& arc) const {
  double time = 0;
  for (std::size_t axis = 0; axis < std::min(target.size(), options_.limits.size()); ++axis) {
    const bool round = arc && (axis == arc->axes[0] || axis == arc->axes[1]);
    const double way = round ? arc->length() : std::abs(target[axis] - position_[axis]);
    time = std::max(time, way / options_.limits[axis].greatest_feed);
  }
  return time;
}

std::optional<Arc> MotionState::arc_to(const std::vector<double>& target,
                                       const Draft& draft) const {
  if (way_ == Way::rapid || way_ == Way::line) {
    return std::nullopt;
  }
  const auto axes = axes_of(plane_);
  if (std::max(axes[0], axes[1]) >= options_.axes.size()) {
    fail(21907, "the channel does not have both axes of the plane for a circle");
  }
  if (draft.has_centre() && draft.has_radius) {
    fail(21024, "a circle has a centre (I, J, K) or a radius (R), not both");
  }
  const auto in_plane = [axes](const std::vector<double>& position) {
    return Point{position[axes[0]], position[axes[1]]};
  };
  const ArcEnds ends{axes, in_plane(position_), in_plane(target), way_ == Way::clockwise};
  if (!draft.has_centre() && radius_) {
    return must(arc_of_radius(ends, *radius_));
  }
  Point centre{};
  for (std::size_t i = 0; i < centre.size(); ++i) {
    centre.at(i) =
        draft.centre.at(axes.at(i)).value_or(0) + (absolute_centre_ ? 0 : ends.begin.at(i));
  }
  const std::size_t other = 3 - axes[0] - axes[1];
  if (draft.centre.at(other)) {
    fail(0, std::string("the centre of a circle lies in its plane; take away the ") + "IJK"[other]);
  }
  return must(arc_around(ends, centre, corrected_centre_));
}

// The axes that are not on the arc move linearly with it (documented).
void MotionState::move(const Draft& draft, Meaning& meaning) {
  std::vector<double> target = position_;
  for (const auto& [axis, value] : draft.axes) {
    target[axis] = incremental_ ? target[axis] + value : value;
  }
  check_limits(target);
  if (way_ != Way::rapid && feed_ == 0) {
    fail(0, "a motion without a feed; program F in its block or before it");
  }
  const auto arc = arc_to(target, draft);
  Motion motion{target, {}, path_length(position_, target), arc};
  if (arc) {
    check_limits(target, *arc);
    std::vector<double> beside = target;
    for (const std::size_t axis : arc->axes) {
      beside[axis] = position_[axis];
    }
    motion.path = std::hypot(arc->length(), path_length(position_, beside));
  }
  const double feed = way_ == Way::rapid ? options_.rapid_feed : feed_;
  motion.duration = scaled(60.0 * std::max(motion.path / feed, least_time(target, arc)));
  meaning.actions.emplace_back(std::move(motion));
  position_ = std::move(target);
}

}  // namespace millrace::cnc::nc::run
