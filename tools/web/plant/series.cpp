#include "tools/web/plant/series.hpp"

#include <algorithm>
#include <cmath>

namespace millrace::tools::web::plant {

namespace {

bool same(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

}  // namespace

void Series::add(fabric::Time at, double value, std::size_t most) {
  while (!points_.empty() && points_.back().at > at) {
    points_.pop_back();
  }
  if (!points_.empty() && same(points_.back().value, value)) {
    return;
  }
  if (!points_.empty() && points_.back().at == at) {
    points_.back().value = value;
  } else {
    thin_out(at);
    points_.push_back({at, value});
  }
  shorten_to(most);
  forget_before(at - kept);
}

void Series::thin_out(fabric::Time at) {
  const auto grain_of = [](fabric::Time time) { return time.time_since_epoch() / grain; };
  const auto in_grain = [&](const Point& point) { return grain_of(point.at) == grain_of(at); };
  const auto first = std::find_if_not(points_.rbegin(), points_.rend(), in_grain).base();
  if (static_cast<std::size_t>(points_.end() - first) < most_in_a_grain) {
    return;
  }
  const auto less = [](const Point& a, const Point& b) {
    // NaN is neither the lowest nor the highest.
    return !std::isnan(a.value) && (std::isnan(b.value) || a.value < b.value);
  };
  const auto lowest = std::min_element(first, points_.end(), less);
  const auto highest = std::max_element(first, points_.end(), [&](const Point& a, const Point& b) {
    return std::isnan(a.value) ? !std::isnan(b.value) : !std::isnan(b.value) && a.value < b.value;
  });
  for (auto point = first; point != points_.end(); ++point) {
    if (point != lowest && point != highest) {
      points_.erase(point);
      return;
    }
  }
}

void Series::forget_before(fabric::Time time) {
  while (points_.size() > 1 && points_[1].at <= time) {
    points_.pop_front();
  }
}

void Series::shorten_to(std::size_t most) {
  while (points_.size() > std::max<std::size_t>(most, 1)) {
    points_.pop_front();
  }
}

}  // namespace millrace::tools::web::plant
