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
    channels_[plan.calls[i].channel].waiting.push_back(i);
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
  for (auto& [key, channel_calls] : channels_) {
    if (channel_calls.waiting.empty() || due(channel_calls.waiting.front()) > now) {
      continue;
    }
    const std::size_t call = channel_calls.waiting.front();
    if (channel_calls.busy) {
      held_up_.insert(call);
    } else if (!first || call < *first) {
      first = call;
    }
  }
  return first ? std::optional(issue(*first)) : std::nullopt;
}

std::optional<std::size_t> Scheduler::next_in_order() {
  // Calls are issued in order, so the next one is the first of its channel.
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
  return channels_.at(call.channel).busy || std::ranges::any_of(open_, [&](std::size_t open) {
           const auto end = plan_.calls[open].end();
           return end && *end <= call.at;
         });
}

std::size_t Scheduler::issue(std::size_t call) {
  ChannelCalls& channel_calls = channels_.at(plan_.calls[call].channel);
  channel_calls.waiting.pop_front();
  channel_calls.busy = true;
  open_.insert(call);
  ++issued_;
  return call;
}

void Scheduler::ended(std::size_t call) {
  if (open_.erase(call) > 0) {
    channels_.at(plan_.calls[call].channel).busy = false;
  }
}

std::optional<nanoseconds> Scheduler::next_time() const {
  if (pace_.timing != Timing::timed) {
    return std::nullopt;
  }
  std::optional<nanoseconds> next;
  for (const auto& [key, channel_calls] : channels_) {
    if (!channel_calls.busy && !channel_calls.waiting.empty()) {
      const nanoseconds time = due(channel_calls.waiting.front());
      next = next ? std::min(*next, time) : time;
    }
  }
  return next;
}

}  // namespace millrace::tools::replay
