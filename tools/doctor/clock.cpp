#include "tools/doctor/clock.hpp"

namespace millrace::tools::doctor {

void ClockComparison::add(const Exchange& exchange) {
  const auto way = exchange.heard - exchange.asked;
  if (way < std::chrono::nanoseconds::zero() || exchange.answered == fabric::Time{}) {
    return;  // Our own clock was set in between, or the other gives no time.
  }
  const auto error = way / 2;
  if (!best_ || error < best_->error) {
    best_ = ClockDifference{exchange.answered - (exchange.asked + error), error};
  }
}

}  // namespace millrace::tools::doctor
