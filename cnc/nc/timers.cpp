#include "cnc/nc/timers.hpp"

#include <algorithm>
#include <limits>

namespace millrace::cnc::nc {

void Timers::start(std::size_t id, Time now) {
  Timer& timer = timers_.at(id);
  if (!timer.running_since) {
    timer.running_since = now;
  }
}

void Timers::stop(std::size_t id, Time now) {
  Timer& timer = timers_.at(id);
  if (timer.running_since) {
    timer.elapsed += now - *timer.running_since;
    timer.running_since.reset();
  }
}

void Timers::clear(std::size_t id) {
  Timer& timer = timers_.at(id);
  timer.elapsed = Time{};
  timer.running_since.reset();
}

void Timers::read(std::size_t id, Time now) {
  Timer& timer = timers_.at(id);
  const Time total = timer.elapsed + (timer.running_since ? now - *timer.running_since : Time{});
  const auto milliseconds = std::chrono::duration_cast<std::chrono::milliseconds>(total).count();
  // 32 bits are enough for 1193 hours.
  timer.latched = static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(milliseconds, 0, std::numeric_limits<std::uint32_t>::max()));
}

}  // namespace millrace::cnc::nc
