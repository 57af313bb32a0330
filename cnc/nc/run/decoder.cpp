#include "cnc/nc/run/decoder.hpp"

#include <algorithm>
#include <utility>

#include "cnc/nc/run/execution.hpp"
#include "cnc/nc/syntax/program.hpp"

namespace millrace::cnc::nc::run {
namespace {

constexpr const char* default_report_file = "message.txt";
constexpr std::size_t most_programs = 200;

std::string text_of(const std::string& name, Environment& environment) {
  auto text = environment.load(name);
  if (!text) {
    if (const auto cycle = shipped_cycle(name)) {
      return std::string(*cycle);
    }
  }
  return values::must(std::move(text));
}

// True if the operation uses a synchronous external variable.
bool synchronises(const syntax::Operation& operation, Environment& environment) {
  return std::any_of(operation.externals.begin(), operation.externals.end(),
                     [&](const syntax::ExternalUse& external) {
                       return external.synchronous || environment.synchronous(external.name);
                     });
}

}  // namespace

std::shared_ptr<const syntax::Program> Library::find(const std::string& name,
                                                     Environment& environment) {
  if (const auto known = programs_.find(name); known != programs_.end()) {
    return known->second;
  }
  if (programs_.size() == most_programs) {
    values::fail(0, "a program calls at most " + std::to_string(most_programs) + " others");
  }
  auto program = syntax::parse_program(name, text_of(name, environment));
  if (!program) {
    const auto& mistakes = program.error();
    values::fail(mistakes.front().id, name + " has " + std::to_string(mistakes.size()) +
                                          " mistakes, the first: " + mistakes.front().to_string());
  }
  auto shared = std::make_shared<const syntax::Program>(std::move(*program));
  programs_.emplace(name, shared);
  return shared;
}

Frame streamed_frame(const std::string& name) {
  auto nothing = std::make_shared<syntax::Program>();
  nothing->file = name;
  Frame frame;
  frame.program = std::move(nothing);
  frame.routine = &frame.program->main;
  frame.streamed = true;
  return frame;
}

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

void Decoder::start(std::shared_ptr<const syntax::Program> program, const Run& run) {
  Frame frame;
  frame.program = std::move(program);
  frame.routine = &frame.program->main;
  start(std::move(frame), run);
}

void Decoder::start_stream(const Run& run) {
  start(streamed_frame(state_.stream_name), run);
}

void Decoder::start(Frame main, const Run& run) {
  skipped_levels_ = run.skipped_levels;
  state_.search = run.search;
  state_.frames.clear();
  state_.frames.push_back(std::move(main));
  state_.blocks_read = 0;
  state_.library.clear();
  state_.skipped.clear();
  state_.report_file = default_report_file;
  state_.awaited_message.reset();
  state_.awaits_timer = false;
}

bool Decoder::skips(const syntax::Operation& operation) const {
  return operation.skip_level > 0 && (skipped_levels_ >> (operation.skip_level - 1U) & 1U) != 0;
}

bool Decoder::read_stream() {
  Stream& stream = state_.around.stream;
  if (stream.empty()) {
    return false;
  }
  auto program = syntax::parse_program(state_.stream_name, values::must(stream.take()));
  if (!program) {
    const Diagnostic& mistake = program.error().front();
    values::fail(mistake.id, "in the packet, " + mistake.to_string());
  }
  Frame& frame = state_.frame();
  frame.program = std::make_shared<const syntax::Program>(std::move(*program));
  frame.routine = &frame.program->main;
  frame.position = 0;
  return true;
}

bool Decoder::reach_end(const Tick& tick) {
  if (state_.frame().streamed) {
    return read_stream();
  }
  Execution execution(state_, tick);
  state_.frames.size() == 1 ? execution.finish_program() : execution.leave_routine();
  return true;
}

bool Decoder::step(const Tick& tick) {
  if (state_.frame().position >= state_.frame().routine->operations.size()) {
    return reach_end(tick);
  }
  Execution execution(state_, tick);
  const syntax::Operation& operation = state_.operation();
  if (skips(operation)) {
    ++state_.frame().position;
    return true;
  }
  execution.read_block_number();
  if (!state_.channel_empty() && synchronises(operation, tick.environment)) {
    state_.around.queue.flush();
    return false;
  }
  const Outcome outcome = std::visit(execution, operation.statement);
  if (outcome == Outcome::done) {
    ++state_.frame().position;
  }
  state_.blocks_read += outcome != Outcome::again ? 1U : 0U;
  return outcome != Outcome::again;
}

std::size_t Decoder::run(std::size_t budget, const Tick& tick) {
  while (running() && budget > 0 && step(tick)) {
    --budget;
  }
  return budget;
}

}  // namespace millrace::cnc::nc::run
