#include "cnc/nc/run/decoder.hpp"

#include <algorithm>
#include <utility>

#include "cnc/nc/run/execution.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::Result;

constexpr const char* default_report_file = "message.txt";

// Does it touch a synchronous external variable?
bool synchronises(const syntax::Operation& operation, Environment& environment) {
  return std::any_of(operation.externals.begin(), operation.externals.end(),
                     [&](const syntax::ExternalUse& external) {
                       return external.synchronous || environment.synchronous(external.name);
                     });
}

}  // namespace

Place DecoderState::place() const {
  if (frames.empty()) {
    return {};
  }
  const Frame& top = frames.back();
  if (top.position >= top.routine->operations.size()) {
    return {top.program->file, 0, 0, 0};
  }
  return {top.program->file, operation().line, operation().column, top.block_number};
}

void Decoder::start(std::shared_ptr<const syntax::Program> program) {
  Frame frame;
  frame.program = std::move(program);
  frame.routine = &frame.program->main;
  state_.frames.clear();
  state_.frames.push_back(std::move(frame));
  state_.library.clear();
  state_.report_file = default_report_file;
  state_.awaited_message.reset();
  state_.awaits_timer = false;
}

bool Decoder::skips(const syntax::Operation& operation) const {
  return operation.skip_level > 0 && (skipped_levels_ >> (operation.skip_level - 1U) & 1U) != 0;
}

Result<bool> Decoder::step(const Tick& tick) {
  Execution execution(state_, tick);
  if (state_.frame().position >= state_.frame().routine->operations.size()) {
    state_.frames.size() == 1 ? execution.finish_program() : execution.leave_routine();
    return true;
  }
  const syntax::Operation& operation = state_.operation();
  if (skips(operation)) {
    ++state_.frame().position;
    return true;
  }
  if (auto numbered = execution.read_block_number(); !numbered) {
    return tl::make_unexpected(numbered.error());
  }
  if (!state_.channel_empty() && synchronises(operation, tick.environment)) {
    state_.around.queue.flush();
    return false;
  }
  const auto outcome = std::visit(execution, operation.statement);
  if (outcome && *outcome == Outcome::done) {
    ++state_.frame().position;
  }
  return outcome.map([](Outcome what) { return what != Outcome::again; });
}

Result<std::size_t> Decoder::run(std::size_t budget, const Tick& tick) {
  for (; running() && budget > 0; --budget) {
    const auto goes_on = step(tick);
    if (!goes_on) {
      return tl::make_unexpected(goes_on.error());
    }
    if (!*goes_on) {
      break;
    }
  }
  return budget;
}

}  // namespace millrace::cnc::nc::run
