#include "base/loop/clock_watch.hpp"

#include <utility>

#include <fmt/format.h>

namespace millrace::base::loop {

namespace {

std::int64_t hours(std::chrono::nanoseconds span) {
  return std::chrono::duration_cast<std::chrono::hours>(span).count();
}

}  // namespace

Clocks clocks_now() {
  return {std::chrono::steady_clock::now(), std::chrono::system_clock::now()};
}

ClockWatch::ClockWatch(std::string what,
                       std::optional<std::chrono::sys_time<std::chrono::nanoseconds>> last_written,
                       Clocks now)
    : what_(std::move(what)), last_(now) {
  if (last_written && now.wall - *last_written > longest_pause) {
    doubt_until_ = now.steady + doubt;
    news_ = fmt::format(
        "by this host's clock {} were last written {} days ago; if that is not so, put the clock "
        "right: in {} hours what is too old by it is removed",
        what_, hours(now.wall - *last_written) / 24, doubt.count());
  }
}

bool ClockWatch::believes(Clocks now) {
  const auto ahead = (now.wall - last_.wall) - (now.steady - last_.steady);
  last_ = now;
  if (ahead > most_correction) {
    doubt_until_ = now.steady + doubt;
    news_ = fmt::format(
        "this host's clock has jumped ahead by {} hours; if that is wrong, put it right: in {} "
        "hours {} that are too old by it are removed",
        hours(ahead), doubt.count(), what_);
  } else if (ahead < -most_correction) {
    doubt_until_.reset();
  }
  if (doubt_until_ && now.steady >= *doubt_until_) {
    doubt_until_.reset();
  }
  return !doubt_until_;
}

std::optional<std::string> ClockWatch::news() {
  return std::exchange(news_, std::nullopt);
}

}  // namespace millrace::base::loop
