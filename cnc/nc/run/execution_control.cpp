// Jumps, to which the parser has reduced the $ statements.
#include <cmath>

#include "cnc/nc/run/execution.hpp"
#include "cnc/nc/values/operations.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fail;

constexpr double same_case = 0.001;

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
  const auto target = routine.labels.find(label);
  if (target == routine.labels.end()) {
    fail(0, "$GOTO to [" + label + "], which is nowhere in this routine");
  }
  return go_to(target->second);
}

}  // namespace millrace::cnc::nc::run
