// Subprograms and cycles.
#include <utility>

#include "cnc/nc/run/execution.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fail;

// The vendor limits the nesting but gives no number; our choice.
constexpr std::size_t deepest_call = 20;

}  // namespace

// The routine that a call names, at its beginning.
Frame Execution::routine_of(const syntax::Name& name, bool local) {
  const std::string written = evaluator_.name_of(name);
  Frame frame;
  if (!local && !written.empty() && written == state_.stream_name) {
    return streamed_frame(written);
  }
  if (!local) {
    frame.program = state_.library.find(written, tick_.environment);
    frame.routine = &frame.program->main;
    return frame;
  }
  frame.program = state_.frame().program;
  const auto subprogram = frame.program->subprograms.find(written);
  if (subprogram == frame.program->subprograms.end()) {
    fail(0, frame.program->file + " has no local subprogram %L " + written);
  }
  frame.routine = &subprogram->second;
  return frame;
}

Outcome Execution::enter(Frame frame, std::optional<CycleArguments> arguments) {
  if (state_.frames.size() > deepest_call) {
    fail(0, "subprograms are nested deeper than " + std::to_string(deepest_call) +
                " levels; does one call itself?");
  }
  ++state_.frame().position;  // where the caller continues
  state_.around.memory.enter_level(std::move(arguments));
  state_.frames.push_back(std::move(frame));
  return Outcome::jumped;
}

Outcome Execution::operator()(const syntax::SubprogramCall& call) {
  return enter(routine_of(call.name, call.local), std::nullopt);
}

CycleArguments Execution::arguments_of(const syntax::CycleCall& call) {
  CycleArguments arguments;
  for (const syntax::CycleArgument& argument : call.arguments) {
    const long number = evaluator_.integer(argument.number);
    arguments.insert_or_assign(number, evaluator_.evaluate(argument.value));
  }
  return arguments;
}

Outcome Execution::operator()(const syntax::CycleCall& call) {
  CycleArguments arguments = arguments_of(call);
  Frame frame = routine_of(call.name, call.local);
  if (call.repeat != syntax::CycleRepeat::once) {
    state_.frame().modal = {frame.program, frame.routine, arguments, call.repeat};
  }
  return enter(std::move(frame), std::move(arguments));
}

Outcome Execution::operator()(const syntax::EndModalCycle& /*end*/) {
  state_.frame().modal.reset();
  return Outcome::done;
}

// Calls the modal cycle of this routine after a block, if it has one that applies to this block.
Outcome Execution::repeat_modal_cycle(bool moved) {
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
