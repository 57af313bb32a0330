#include "cnc/nc/run/interpolator.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "cnc/nc/run/block.hpp"
#include "cnc/nc/run/motion.hpp"

namespace millrace::cnc::nc::run {
namespace {

// Avoids a division by zero: at this override a motion takes practically for ever.
constexpr double least_factor = 1e-9;
// Keeps times representable.
constexpr std::chrono::duration<double> longest_approach{1e9};

}  // namespace

bool Interpolator::advance(const Tick& tick, Queue& queue) {
  bool progress = false;
  now_ = tick.now;
  while (true) {
    if (!current_) {
      const Block* next = queue.next();
      if (next != nullptr && next->skipped) {
        progress = true;
        skip(queue.take(), tick);
        continue;
      }
      if (next == nullptr || !may_begin(*next, tick)) {
        break;
      }
      progress = true;
      begin_next(queue);
    }
    if (!execute(tick)) {
      return progress;
    }
    progress = true;
    current_.reset();
  }
  time_ = tick.now;  // waits for the decoder or the operator
  return progress;
}

void Interpolator::skip(const Block& block, const Tick& tick) {
  count_ = block.count;
  if (const auto* motion = std::get_if<Motion>(&block.action)) {
    approach_ = motion->target;
  } else if (const auto* order = std::get_if<TimerOrder>(&block.action)) {
    carry_out(*order, timers_, tick.now);
  } else if (std::holds_alternative<End>(block.action)) {
    tick.emit(WarningEvent{{block.place, 0, "the block that is searched for did not come"}});
    finished_ = true;
  }
}

void Interpolator::begin_next(Queue& queue) {
  auto approach = std::exchange(approach_, std::nullopt);
  if (!approach) {
    begin(queue.take());
    return;
  }
  Block way = *queue.next();
  const double path = path_length(position_, *approach);
  const auto time = std::min(path * rapid_, longest_approach);
  way.action =
      Motion{std::move(*approach), std::chrono::duration_cast<Duration>(time), path, std::nullopt};
  begin(std::move(way));
}

bool Interpolator::stops_before(const Block& block) const {
  // There is no stop between the parts of one program block.
  if (!step_.enabled || block.count == count_ || std::holds_alternative<End>(block.action)) {
    return false;
  }
  switch (step_.mode) {
    case SingleStep::Mode::over:
      return block.level <= level_;
    case SingleStep::Mode::out:
      return block.level < level_;
    case SingleStep::Mode::to_next_motion:
      return std::holds_alternative<Motion>(block.action);
    default:
      return true;
  }
}

bool Interpolator::may_begin(const Block& block, const Tick& tick) {
  if (!step_announced_) {
    if (!stops_before(block)) {
      return true;
    }
    step_announced_ = true;
    held_ = true;
    level_ = block.level;
    tick.emit(HeldEvent{block.place, true});
  }
  if (held_) {
    return false;
  }
  step_announced_ = false;
  time_ = tick.now;
  return true;
}

void Interpolator::begin(Block block) {
  count_ = block.count;
  if (!step_.enabled) {
    level_ = block.level;
  }
  place_ = block.place;
  since_ = time_;
  done_ = Duration{};
  part_ = 0;
  begin_ = position_;
  sent_.reset();
  waited_ = false;
  hold_announced_ = false;
  current_ = std::move(block);
}

bool Interpolator::execute(const Tick& tick) {
  assert(current_);
  return std::visit([&](const auto& action) { return execute(action, tick); }, current_->action);
}

Duration Interpolator::done_by(Duration time, double factor) const {
  const Duration passed = time - since_;
  return done_ + (factor == 1
                      ? passed
                      : std::chrono::duration_cast<Duration>(
                            std::chrono::duration<double, Duration::period>(passed) * factor));
}

bool Interpolator::passes(Duration duration, double factor, const Tick& tick) {
  if (duration > done_by(tick.now, factor)) {
    return false;
  }
  const auto left = duration - done_;
  time_ = since_ + (factor == 1 ? left
                                : Duration(std::llround(static_cast<double>(left.count()) /
                                                        std::max(factor, least_factor))));
  time_ = std::clamp(time_, since_, tick.now);
  return true;
}

bool Interpolator::waits_for(bool condition, const Tick& tick) {
  if (condition && waited_) {
    time_ = tick.now;
  }
  waited_ = !condition;
  return condition;
}

void Interpolator::go_to(const Motion& motion, double part) {
  part_ = part;
  for (std::size_t axis = 0; axis < position_.size(); ++axis) {
    position_[axis] = begin_[axis] + (motion.target[axis] - begin_[axis]) * part;
  }
  if (motion.arc && part < 1) {
    const Point point = motion.arc->at(part);
    position_[motion.arc->axes[0]] = point[0];
    position_[motion.arc->axes[1]] = point[1];
  }
}

bool Interpolator::execute(const Motion& motion, const Tick& tick) {
  if (passes(motion.duration, override_, tick)) {
    path_ += motion.path;
    position_ = motion.target;
    return true;
  }
  go_to(motion, std::clamp(static_cast<double>(done_by(tick.now, override_).count()) /
                               static_cast<double>(motion.duration.count()),
                           0.0, 1.0));
  return false;
}

bool Interpolator::execute(const Dwell& dwell, const Tick& tick) {
  return passes(dwell.duration, 1, tick);
}

bool Interpolator::execute(const MachineFunction& function, const Tick& tick) {
  tick.emit(MachineFunctionEvent{function.number, function.argument});
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

bool Interpolator::execute(const DataWrite& write, const Tick& tick) {
  if (auto written = carry_out(write.order, tick.environment); !written) {
    fault_ = std::move(written.error());
  }
  return !fault_;
}

bool Interpolator::execute(const Hold& /*hold*/, const Tick& tick) {
  if (!hold_announced_) {
    hold_announced_ = true;
    held_ = true;
    tick.emit(HeldEvent{place_, false});
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
  status.blocks = count_;
  if (!current_) {
    return status;
  }
  if (const auto* motion = std::get_if<Motion>(&current_->action)) {
    const std::chrono::duration<double> seconds = motion->duration;
    status.programmed_velocity = motion->path / seconds.count();
    status.velocity = status.programmed_velocity * override_;
    status.rest_path = motion->path * (1 - part_);
    status.path += motion->path * part_;
  } else if (const auto* dwell = std::get_if<Dwell>(&current_->action)) {
    status.dwell_left = dwell->duration - done_by(now_, 1);
  }
  return status;
}

const std::vector<double>& Interpolator::target() const {
  const auto* motion = current_ ? std::get_if<Motion>(&current_->action) : nullptr;
  return motion != nullptr ? motion->target : position_;
}

std::vector<double> Interpolator::velocities() const {
  std::vector<double> velocities(position_.size());
  const auto* motion = current_ ? std::get_if<Motion>(&current_->action) : nullptr;
  if (motion == nullptr) {
    return velocities;
  }
  const double seconds = std::chrono::duration<double>(motion->duration).count();
  for (std::size_t axis = 0; axis < velocities.size(); ++axis) {
    velocities[axis] = (motion->target[axis] - begin_[axis]) / seconds * override_;
  }
  if (motion->arc) {
    const Point direction = motion->arc->direction(part_);
    velocities[motion->arc->axes[0]] = direction[0] / seconds * override_;
    velocities[motion->arc->axes[1]] = direction[1] / seconds * override_;
  }
  return velocities;
}

// The motion so far used the old factor.
void Interpolator::set_feed_override(double factor) {
  if (current_ && std::holds_alternative<Motion>(current_->action) && now_ > since_) {
    done_ = done_by(now_, override_);
    since_ = now_;
  }
  override_ = factor;
}

void Interpolator::start_program() {
  path_ = 0;
  count_ = 0;
  level_ = 0;
}

void Interpolator::reset() {
  current_.reset();
  held_ = false;
  step_announced_ = false;
  approach_.reset();
  finished_ = false;
  fault_.reset();
}

}  // namespace millrace::cnc::nc::run
