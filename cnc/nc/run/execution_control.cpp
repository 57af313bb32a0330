// Jumps, to which the parser has reduced the $ statements; subprograms and cycles.
#include <cmath>
#include <utility>

#include "cnc/nc/characters.hpp"
#include "cnc/nc/run/execution.hpp"
#include "cnc/nc/values/operations.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fail;

constexpr double same_case = 0.001;
// The vendor limits the nesting but gives no number; our choice.
constexpr std::size_t deepest_call = 20;

bool judge(syntax::ConditionRule rule, double value) {
  switch (rule) {
    case syntax::ConditionRule::half_or_beyond:
      return values::is_true(value);
    case syntax::ConditionRule::above_half:
      return value > 0.5;
    default:
      return value >= 0.5;
  }
}

}  // namespace

Outcome Execution::go_to(std::size_t operation) {
  state_.frame().position = operation;
  return Outcome::jumped;
}

Outcome Execution::operator()(const syntax::Jump& jump) {
  return go_to(jump.target);
}

Outcome Execution::operator()(const syntax::Branch& branch) {
  const double value = evaluator_.number(branch.condition);
  return judge(branch.rule, value) == branch.when ? go_to(branch.target) : Outcome::done;
}

Outcome Execution::operator()(const syntax::For& loop) {
  if (evaluator_.number(loop.step) == 0) {
    warn("the step of $FOR is 0: the loop never ends by itself");
  }
  evaluator_.write(loop.counter, evaluator_.evaluate(loop.start));
  return enter_loop(loop, state_.frame().position);
}

Outcome Execution::operator()(const syntax::EndFor& end) {
  const auto& loop = std::get<syntax::For>(state_.frame().routine->operations[end.loop].statement);
  change(loop.counter, values::BinaryOperator::add, evaluator_.evaluate(loop.step));
  return enter_loop(loop, end.loop);
}

// The counter is tested before each pass; with a step of 0 it never passes the end.
Outcome Execution::enter_loop(const syntax::For& loop, std::size_t begin) {
  const double counter = values::must(values::number(evaluator_.read(loop.counter)));
  const double end = evaluator_.number(loop.end);
  const double by = evaluator_.number(loop.step);
  const bool over = (by > 0 && counter > end) || (by < 0 && counter < end);
  return go_to(over ? loop.exit : begin + 1);
}

Outcome Execution::operator()(const syntax::Switch& selection) {
  const double selector = evaluator_.number(selection.selector);
  for (const syntax::SwitchCase& candidate : selection.cases) {
    if (std::abs(evaluator_.number(candidate.value) - selector) < same_case) {
      return go_to(candidate.target);
    }
  }
  return go_to(selection.otherwise);
}

Outcome Execution::operator()(const syntax::Goto& jump) {
  const syntax::Routine& routine = *state_.frame().routine;
  if (const auto* expression = std::get_if<syntax::Expression>(&jump.target)) {
    const long number = evaluator_.integer(*expression);
    const auto target = routine.numbers.find(number);
    if (target == routine.numbers.end()) {
      fail(0, "$GOTO to N" + std::to_string(number) +
                  ", but no block of this routine begins with that number and a colon");
    }
    return go_to(target->second);
  }
  const std::string label = evaluator_.name_of(std::get<syntax::Name>(jump.target));
  const auto target = routine.labels.find(upper(label));
  if (target == routine.labels.end()) {
    fail(0, "$GOTO to [" + label + "], which is nowhere in this routine");
  }
  return go_to(target->second);
}

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
