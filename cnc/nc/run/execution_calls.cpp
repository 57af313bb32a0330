// Subprograms and cycles.
#include <utility>

#include "cnc/nc/run/execution.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fault;
using values::Result;

// The vendor limits the nesting but gives no number; our choice.
constexpr std::size_t deepest_call = 20;

}  // namespace

// The routine that a call names, at its beginning.
Result<Frame> Execution::routine_of(const syntax::Name& name, bool local) {
  const auto written = evaluator_.name_of(name);
  if (!written) {
    return tl::make_unexpected(written.error());
  }
  Frame frame;
  if (!local && !written->empty() && *written == state_.stream_name) {
    return streamed_frame(*written);
  }
  if (!local) {
    auto program = state_.library.find(*written, tick_.environment);
    if (!program) {
      return tl::make_unexpected(program.error());
    }
    frame.program = std::move(*program);
    frame.routine = &frame.program->main;
    return frame;
  }
  frame.program = state_.frame().program;
  const auto subprogram = frame.program->subprograms.find(*written);
  if (subprogram == frame.program->subprograms.end()) {
    return fault(0, frame.program->file + " has no local subprogram %L " + *written);
  }
  frame.routine = &subprogram->second;
  return frame;
}

Result<Outcome> Execution::enter(Frame frame, std::optional<CycleArguments> arguments) {
  if (state_.frames.size() > deepest_call) {
    return fault(0, "subprograms are nested deeper than " + std::to_string(deepest_call) +
                        " levels; does one call itself?");
  }
  ++state_.frame().position;  // where the caller continues
  state_.around.memory.enter_level(std::move(arguments));
  state_.frames.push_back(std::move(frame));
  return Outcome::jumped;
}

Result<Outcome> Execution::operator()(const syntax::SubprogramCall& call) {
  return routine_of(call.name, call.local).and_then([this](Frame frame) {
    return enter(std::move(frame), std::nullopt);
  });
}

Result<CycleArguments> Execution::arguments_of(const syntax::CycleCall& call) {
  CycleArguments arguments;
  for (const syntax::CycleArgument& argument : call.arguments) {
    const auto number = evaluator_.integer(argument.number);
    auto value = number ? evaluator_.evaluate(argument.value) : tl::make_unexpected(number.error());
    if (!value) {
      return tl::make_unexpected(value.error());
    }
    arguments.insert_or_assign(*number, std::move(*value));
  }
  return arguments;
}

Result<Outcome> Execution::operator()(const syntax::CycleCall& call) {
  auto arguments = arguments_of(call);
  if (!arguments) {
    return tl::make_unexpected(arguments.error());
  }
  auto frame = routine_of(call.name, call.local);
  if (!frame) {
    return tl::make_unexpected(frame.error());
  }
  if (call.repeat != syntax::CycleRepeat::once) {
    state_.frame().modal = {frame->program, frame->routine, *arguments, call.repeat};
  }
  return enter(std::move(*frame), std::move(*arguments));
}

Result<Outcome> Execution::operator()(const syntax::EndModalCycle& /*end*/) {
  state_.frame().modal.reset();
  return Outcome::done;
}

// Calls the modal cycle of this routine after a block, if it has one that applies to this block.
Result<Outcome> Execution::repeat_modal_cycle(bool moved) {
  const auto& modal = state_.frame().modal;
  if (!modal || (modal->repeat == syntax::CycleRepeat::after_motion && !moved)) {
    return Outcome::done;
  }
  Frame frame;
  frame.program = modal->program;
  frame.routine = modal->routine;
  return enter(std::move(frame), modal->arguments);
}

void Execution::leave_routine() {
  state_.frames.pop_back();
  state_.around.memory.leave_level();
}

void Execution::finish_program() {
  push(End{});
  state_.around.queue.flush();
  state_.frames.clear();
}

}  // namespace millrace::cnc::nc::run
