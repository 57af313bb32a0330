#include "cnc/nc/run/interpolator.hpp"

#include <utility>

#include "cnc/nc/run/motion.hpp"
#include "cnc/nc/run/timer_order.hpp"

namespace millrace::cnc::nc::run {

bool Interpolator::advance(const Tick& tick, Queue& queue) {
  bool progress = false;
  now_ = tick.now;
  while (true) {
    if (!current_) {
      auto block = queue.pop();
      if (!block) {
        break;
      }
      progress = true;
      begin(std::move(*block));
    }
    if (!execute(tick)) {
      return progress;
    }
    progress = true;
    current_.reset();
  }
  time_ = tick.now;  // it waits for the decoder
  return progress;
}

void Interpolator::begin(Block block) {
  ++blocks_;
  place_ = block.place;
  started_ = time_;
  begin_ = position_;
  sent_.reset();
  waited_ = false;
  hold_announced_ = false;
  current_ = std::move(block);
}

bool Interpolator::execute(const Tick& tick) {
  return std::visit([&](const auto& action) { return execute(action, tick); }, current_->action);
}

bool Interpolator::passes(Duration duration, const Tick& tick) {
  const Duration end = started_ + duration;
  if (end > tick.now) {
    return false;
  }
  time_ = end;
  return true;
}

bool Interpolator::waits_for(bool condition, const Tick& tick) {
  if (condition && waited_) {
    time_ = tick.now;
  }
  waited_ = !condition;
  return condition;
}

bool Interpolator::execute(const Motion& motion, const Tick& tick) {
  if (passes(motion.duration, tick)) {
    path_ += path_length(begin_, motion.target);
    position_ = motion.target;
    return true;
  }
  const double part = static_cast<double>((tick.now - started_).count()) /
                      static_cast<double>(motion.duration.count());
  for (std::size_t axis = 0; axis < position_.size(); ++axis) {
    position_[axis] = begin_[axis] + (motion.target[axis] - begin_[axis]) * part;
  }
  return false;
}

bool Interpolator::execute(const Dwell& dwell, const Tick& tick) {
  return passes(dwell.duration, tick);
}

bool Interpolator::execute(const MachineFunction& function, const Tick& tick) {
  tick.emit(MachineFunctionEvent{function.number});
  return true;
}

bool Interpolator::execute(const SynchronousMessage& order, const Tick& tick) {
  if (!sent_ && !messages_.full()) {
    MessageEvent message = order.message;
    sent_ = messages_.send(message);
    tick.emit(std::move(message));
  }
  return waits_for(sent_ && messages_.acknowledged(*sent_), tick);
}

bool Interpolator::execute(const TimerOrder& order, const Tick& /*tick*/) {
  carry_out(order, timers_, time_);
  return true;
}

bool Interpolator::execute(const Hold& /*hold*/, const Tick& tick) {
  if (!hold_announced_) {
    hold_announced_ = true;
    held_ = true;
    tick.emit(HeldEvent{place_});
  }
  return waits_for(!held_, tick);
}

bool Interpolator::execute(const End& /*end*/, const Tick& /*tick*/) {
  finished_ = true;
  return true;
}

MotionStatus Interpolator::status() const {
  MotionStatus status;
  status.path = path_;
  status.blocks = blocks_;
  if (!current_) {
    return status;
  }
  if (const auto* motion = std::get_if<Motion>(&current_->action)) {
    const std::chrono::duration<double> seconds = motion->duration;
    status.velocity = path_length(begin_, motion->target) / seconds.count();
    status.rest_path = path_length(position_, motion->target);
    status.path += path_length(begin_, position_);
  } else if (const auto* dwell = std::get_if<Dwell>(&current_->action)) {
    status.dwell_left = started_ + dwell->duration - now_;
  }
  return status;
}

void Interpolator::start_program() {
  path_ = 0;
  blocks_ = 0;
}

void Interpolator::reset() {
  current_.reset();
  held_ = false;
  finished_ = false;
}

}  // namespace millrace::cnc::nc::run
