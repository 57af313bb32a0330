#include "tools/replay/scheduler.hpp"

#include <algorithm>
#include <cmath>

namespace millrace::tools::replay {

nanoseconds Pace::scaled(nanoseconds recorded) const {
  if (timing != Timing::timed || rate == 1) {
    return recorded;
  }
  return nanoseconds(std::llround(static_cast<double>(recorded.count()) / rate));
}

Scheduler::Scheduler(const Plan& plan, Pace pace) : plan_(plan), pace_(pace) {
  for (std::size_t i = 0; i < plan.calls.size(); ++i) {
    lanes_[plan.calls[i].channel].waiting.push_back(i);
  }
}

std::optional<std::size_t> Scheduler::next(nanoseconds now) {
  return pace_.timing == Timing::timed ? next_timed(now) : next_in_order();
}

nanoseconds Scheduler::due(std::size_t call) const {
  return pace_.scaled(plan_.calls.at(call).at);
}

std::optional<std::size_t> Scheduler::next_timed(nanoseconds now) {
  std::optional<std::size_t> first;
  for (auto& [key, lane] : lanes_) {
    if (lane.waiting.empty() || due(lane.waiting.front()) > now) {
      continue;
    }
    const std::size_t call = lane.waiting.front();
    if (lane.busy) {
      held_up_.insert(call);
    } else if (!first || call < *first) {
      first = call;
    }
  }
  return first ? std::optional(issue(*first)) : std::nullopt;
}

std::optional<std::size_t> Scheduler::next_in_order() {
  // Calls are issued in their order, so the next one is the first of its lane.
  if (issued_ == plan_.calls.size() || must_wait(plan_.calls[issued_])) {
    return std::nullopt;
  }
  if (pace_.timing == Timing::step) {
    if (allowed_ == 0) {
      return std::nullopt;
    }
    --allowed_;
  }
  return issue(issued_);
}

bool Scheduler::must_wait(const PlannedCall& call) const {
  if (pace_.timing == Timing::step) {
    return !open_.empty();
  }
  return lanes_.at(call.channel).busy || std::ranges::any_of(open_, [&](std::size_t open) {
           const auto end = plan_.calls[open].end();
           return end && *end <= call.at;
         });
}

std::size_t Scheduler::issue(std::size_t call) {
  Lane& lane = lanes_.at(plan_.calls[call].channel);
  lane.waiting.pop_front();
  lane.busy = true;
  open_.insert(call);
  ++issued_;
  return call;
}

void Scheduler::ended(std::size_t call) {
  if (open_.erase(call) > 0) {
    lanes_.at(plan_.calls[call].channel).busy = false;
  }
}

std::optional<nanoseconds> Scheduler::next_time() const {
  if (pace_.timing != Timing::timed) {
    return std::nullopt;
  }
  std::optional<nanoseconds> next;
  for (const auto& [key, lane] : lanes_) {
    if (!lane.busy && !lane.waiting.empty()) {
      const nanoseconds time = due(lane.waiting.front());
      next = next ? std::min(*next, time) : time;
    }
  }
  return next;
}

}  // namespace millrace::tools::replay
