#include "cnc/nc/channel.hpp"

#include <algorithm>
#include <functional>
#include <optional>
#include <utility>

#include "cnc/nc/run/decoder.hpp"
#include "cnc/nc/syntax/program.hpp"

namespace millrace::cnc::nc {

namespace {

// Time of one millimetre of rapid motion.
std::chrono::duration<double> rapid_time(const ChannelOptions& options) {
  return std::chrono::duration<double>(60 / options.rapid_feed * options.time_scale);
}

}  // namespace

Channel::Channel(ChannelOptions options, std::shared_ptr<Timers> timers)
    : options_(std::move(options)),
      timers_(timers ? std::move(timers) : std::make_shared<Timers>()),
      motion_({options_.axes, options_.limits, options_.rapid_feed, options_.time_scale,
               options_.optional_stop}),
      queue_(options_.queue, options_.withhold_last_motion),
      messages_(options_.messages_read_at_once),
      interpolator_(options_.axes.size(), rapid_time(options_), messages_, *timers_),
      system_(options_.axes, motion_, interpolator_, *timers_),
      decoder_(
          {memory_, macros_, motion_, queue_, interpolator_, messages_, *timers_, stream_, system_},
          options_.stream_program, options_.flush_continue_waits,
          std::chrono::duration_cast<std::chrono::nanoseconds>(options_.cycle *
                                                               options_.time_scale)) {}

tl::expected<void, std::vector<Diagnostic>> Channel::start(const std::string& file,
                                                           const std::string& text) {
  if (state_ != ChannelState::idle) {
    return tl::make_unexpected(std::vector<Diagnostic>{{{file, 0, 0, 0}, 0, refusal()}});
  }
  const bool streamed = !file.empty() && file == options_.stream_program;
  auto program = syntax::parse_program(file, streamed ? "" : text);
  if (!program) {
    return tl::make_unexpected(std::move(program.error()));
  }
  memory_.start_program();
  motion_.reset(interpolator_.position());
  interpolator_.start_program();
  if (streamed) {
    decoder_.start_stream({options_.skipped_levels, search_});
  } else {
    decoder_.start(std::make_shared<const syntax::Program>(std::move(*program)),
                   {options_.skipped_levels, search_});
  }
  state_ = ChannelState::active;
  return {};
}

std::string Channel::refusal() const {
  if (state_ != ChannelState::error) {
    return "a program is running; wait for its end or reset the channel";
  }
  return decoder_.restart_needed() ? "the channel is in a fatal error; restart the controller"
                                   : "the channel is in error; reset it before the next start";
}

void Channel::stop() {
  decoder_.stop();
  queue_.clear();
  interpolator_.reset();
  messages_.reset();
}

AbortedEvent Channel::abort(Fault fault, const Place& place) {
  AbortedEvent aborted{{place, fault.id, std::move(fault.text)}, decoder_.restart_needed()};
  stop();
  state_ = ChannelState::error;
  return aborted;
}

std::optional<AbortedEvent> Channel::abort(Fault fault) {
  return active() ? std::optional(abort(std::move(fault), decoder_place())) : std::nullopt;
}

void Channel::reset() {
  stop();
  stream_.clear();
  if (!decoder_.restart_needed()) {
    state_ = ChannelState::idle;
  }
}

void Channel::resume() {
  if (state_ == ChannelState::held) {
    interpolator_.resume();
    state_ = ChannelState::active;
  }
}

void Channel::set_optional_stop(bool on) {
  options_.optional_stop = on;
  motion_.set_optional_stop(on);
}

bool Channel::step(const run::Tick& tick, std::size_t& budget) {
  const bool moved = interpolator_.advance(tick, queue_);
  if (auto failed = interpolator_.take_fault()) {
    tick.emit(abort(std::move(*failed), interpolator_.place()));
    return false;
  }
  if (interpolator_.finished()) {
    stop();
    state_ = ChannelState::idle;
    tick.emit(FinishedEvent{});
    return false;
  }
  state_ = interpolator_.held() ? ChannelState::held : ChannelState::active;
  const std::size_t before = budget;
  try {
    budget = decoder_.run(budget, tick);
  } catch (values::Aborted& aborted) {
    tick.emit(abort(std::move(aborted.fault), decoder_.place()));
    return false;
  }
  return budget > 0 && (moved || budget != before);
}

std::vector<Event> Channel::tick(std::chrono::nanoseconds now, Environment& environment,
                                 std::size_t operations) {
  std::vector<Event> events;
  if (!active()) {
    return events;
  }
  const std::function<void(Event)> emit = [&events](Event event) {
    events.push_back(std::move(event));
  };
  const run::Tick tick{now, environment, emit};
  std::size_t budget = std::min(options_.decoder_budget, operations);
  while (step(tick, budget)) {
  }
  return events;
}

std::vector<AxisPosition> Channel::axes() const {
  std::vector<AxisPosition> axes;
  const std::vector<double>& position = interpolator_.position();
  const std::vector<double>& target = interpolator_.target();
  const std::vector<double> velocities = interpolator_.velocities();
  for (std::size_t axis = 0; axis < position.size(); ++axis) {
    axes.push_back({options_.axes[axis], position[axis], target[axis], velocities[axis]});
  }
  return axes;
}

std::vector<Diagnostic> check(const std::string& file, const std::string& text) {
  auto program = syntax::parse_program(file, text);
  return program ? std::move(program->doubts) : std::move(program.error());
}

}  // namespace millrace::cnc::nc
