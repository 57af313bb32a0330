#include "cnc/simulator/cycle.hpp"

#include <algorithm>
#include <utility>

namespace millrace::cnc::simulator {

namespace {

using TimePoint = std::chrono::steady_clock::time_point;

}  // namespace

Cycle::Cycle(const boost::asio::any_io_executor& executor, std::chrono::nanoseconds period,
             Work work)
    : timer_(executor), period_(period), work_(std::move(work)) {}

void Cycle::wake() {
  if (!awake_) {
    awake_ = true;
    timer_.expires_at(next_cycle(std::chrono::steady_clock::now()));
    wait();
  }
}

void Cycle::stop() {
  awake_ = false;
  timer_.cancel();
}

void Cycle::wait() {
  timer_.async_wait([this](const boost::system::error_code& cancelled) {
    if (!cancelled && awake_) {
      run();
    }
  });
}

void Cycle::run() {
  const TimePoint now = std::chrono::steady_clock::now();
  count(now - timer_.expiry());
  awake_ = work_(now.time_since_epoch()) && awake_;
  if (awake_) {
    // After a delay the next cycle begins at its regular time; missed cycles are skipped.
    timer_.expires_at(std::max(timer_.expiry() + period_, next_cycle(now)));
    wait();
  }
}

TimePoint Cycle::next_cycle(TimePoint now) const {
  return TimePoint((now.time_since_epoch() / period_ + 1) * period_);
}

void Cycle::count(std::chrono::nanoseconds delay) {
  ++counts_.done;
  counts_.late += delay >= period_ ? 1U : 0U;
  counts_.worst = std::max(counts_.worst, delay);
}

}  // namespace millrace::cnc::simulator
