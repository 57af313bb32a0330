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

struct Channel::State {
  State(ChannelOptions given, std::shared_ptr<Timers> shared)
      : options(std::move(given)),
        timers(shared ? std::move(shared) : std::make_shared<Timers>()),
        motion({options.axes, options.limits, options.rapid_feed, options.time_scale,
                options.optional_stop}),
        queue(options.queue, options.withhold_last_motion),
        messages(options.messages_read_at_once),
        interpolator(options.axes.size(), rapid_time(options), messages, *timers),
        system(options.axes, motion, interpolator, *timers),
        decoder({memory, macros, motion, queue, interpolator, messages, *timers, stream, system},
                options.stream_program, options.flush_continue_waits,
                std::chrono::duration_cast<std::chrono::nanoseconds>(options.cycle *
                                                                     options.time_scale)) {}

  /// Why no program can start now.
  std::string refusal() const;
  AbortedEvent abort(Fault fault, const Place& place);
  void stop();
  bool step(const run::Tick& tick, std::size_t& budget);

  ChannelOptions options;
  std::shared_ptr<Timers> timers;
  run::Memory memory;
  run::Macros macros;
  run::MotionState motion;
  run::Queue queue;
  run::MessageBox messages;
  run::Stream stream;
  run::Interpolator interpolator;
  run::SystemVariables system;
  run::Decoder decoder;
  std::optional<long> search;
  ChannelState state = ChannelState::idle;
};

Channel::Channel(ChannelOptions options, std::shared_ptr<Timers> timers)
    : state_(std::make_unique<State>(std::move(options), std::move(timers))) {}
Channel::~Channel() = default;
Channel::Channel(Channel&&) noexcept = default;
Channel& Channel::operator=(Channel&&) noexcept = default;

tl::expected<void, std::vector<Diagnostic>> Channel::start(const std::string& file,
                                                           const std::string& text) {
  if (state_->state != ChannelState::idle) {
    return tl::make_unexpected(std::vector<Diagnostic>{{{file, 0, 0, 0}, 0, state_->refusal()}});
  }
  const bool streamed = !file.empty() && file == state_->options.stream_program;
  auto program = syntax::parse_program(file, streamed ? "" : text);
  if (!program) {
    return tl::make_unexpected(std::move(program.error()));
  }
  state_->memory.start_program();
  state_->motion.reset(state_->interpolator.position());
  state_->interpolator.start_program();
  if (streamed) {
    state_->decoder.start_stream({state_->options.skipped_levels, state_->search});
  } else {
    state_->decoder.start(std::make_shared<const syntax::Program>(std::move(*program)),
                          {state_->options.skipped_levels, state_->search});
  }
  state_->state = ChannelState::active;
  return {};
}

std::string Channel::State::refusal() const {
  if (state != ChannelState::error) {
    return "a program is running; wait for its end or reset the channel";
  }
  return decoder.restart_needed() ? "the channel is in a fatal error; restart the controller"
                                  : "the channel is in error; reset it before the next start";
}

void Channel::State::stop() {
  decoder.stop();
  queue.clear();
  interpolator.reset();
  messages.reset();
}

AbortedEvent Channel::State::abort(Fault fault, const Place& place) {
  AbortedEvent aborted{{place, fault.id, std::move(fault.text)}, decoder.restart_needed()};
  stop();
  state = ChannelState::error;
  return aborted;
}

std::optional<AbortedEvent> Channel::abort(Fault fault) {
  return active() ? std::optional(state_->abort(std::move(fault), decoder_place())) : std::nullopt;
}

void Channel::reset() {
  state_->stop();
  state_->stream.clear();
  if (!state_->decoder.restart_needed()) {
    state_->state = ChannelState::idle;
  }
}

void Channel::resume() {
  if (state_->state == ChannelState::held) {
    state_->interpolator.resume();
    state_->state = ChannelState::active;
  }
}

void Channel::set_feed_override(double factor) {
  state_->interpolator.set_feed_override(factor);
}

double Channel::feed_override() const {
  return state_->interpolator.feed_override();
}

void Channel::set_single_step(SingleStep step) {
  state_->interpolator.set_single_step(step);
}

SingleStep Channel::single_step() const {
  return state_->interpolator.single_step();
}

void Channel::set_block_search(std::optional<long> block) {
  state_->search = block;
}

bool Channel::searching() const {
  return state_->decoder.searching();
}

void Channel::set_optional_stop(bool on) {
  state_->options.optional_stop = on;
  state_->motion.set_optional_stop(on);
}

bool Channel::optional_stop() const {
  return state_->options.optional_stop;
}

void Channel::set_skipped_levels(std::uint16_t levels) {
  state_->options.skipped_levels = levels;
}

std::uint16_t Channel::skipped_levels() const {
  return state_->options.skipped_levels;
}

tl::expected<void, Fault> Channel::stream(std::string packet) {
  return state_->stream.write(std::move(packet));
}

void Channel::read_messages(std::uint64_t number) {
  state_->messages.read(number);
}

void Channel::acknowledge(std::uint64_t number) {
  state_->messages.acknowledge(number);
}

// Runs both stages once; true if another round could make progress at this time.
bool Channel::State::step(const run::Tick& tick, std::size_t& budget) {
  const bool moved = interpolator.advance(tick, queue);
  if (auto failed = interpolator.take_fault()) {
    tick.emit(abort(std::move(*failed), interpolator.place()));
    return false;
  }
  if (interpolator.finished()) {
    stop();
    state = ChannelState::idle;
    tick.emit(FinishedEvent{});
    return false;
  }
  state = interpolator.held() ? ChannelState::held : ChannelState::active;
  auto left = decoder.run(budget, tick);
  if (!left) {
    tick.emit(abort(std::move(left.error()), decoder.place()));
    return false;
  }
  const bool decoded = *left != budget;
  budget = *left;
  return budget > 0 && (moved || decoded);
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
  std::size_t budget = std::min(state_->options.decoder_budget, operations);
  while (state_->step(tick, budget)) {
  }
  return events;
}

const ChannelOptions& Channel::options() const {
  return state_->options;
}

ChannelState Channel::state() const {
  return state_->state;
}

bool Channel::active() const {
  return state_->state == ChannelState::active || state_->state == ChannelState::held;
}

std::vector<AxisPosition> Channel::axes() const {
  std::vector<AxisPosition> axes;
  const std::vector<double>& position = state_->interpolator.position();
  const std::vector<double>& target = state_->interpolator.target();
  const std::vector<double> velocities = state_->interpolator.velocities();
  for (std::size_t axis = 0; axis < position.size(); ++axis) {
    axes.push_back({state_->options.axes[axis], position[axis], target[axis], velocities[axis]});
  }
  return axes;
}

MotionStatus Channel::motion() const {
  return state_->interpolator.status();
}

long Channel::block_number() const {
  return state_->interpolator.place().block;
}

Place Channel::decoder_place() const {
  return state_->decoder.place();
}

VariableDirectory& Channel::variables() {
  return state_->memory;
}

std::vector<Diagnostic> check(const std::string& file, const std::string& text) {
  auto program = syntax::parse_program(file, text);
  return program ? std::move(program->doubts) : std::move(program.error());
}

}  // namespace millrace::cnc::nc
