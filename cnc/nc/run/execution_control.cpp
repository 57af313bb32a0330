// Jumps, to which the parser has reduced the $ statements.
#include <cmath>

#include "cnc/nc/run/execution.hpp"
#include "cnc/nc/values/operations.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fault;
using values::Result;

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

Result<Outcome> Execution::operator()(const syntax::Jump& jump) {
  return go_to(jump.target);
}

Result<Outcome> Execution::operator()(const syntax::Branch& branch) {
  return evaluator_.number(branch.condition).map([&](double value) {
    return judge(branch.rule, value) == branch.when ? go_to(branch.target) : Outcome::done;
  });
}

Result<Outcome> Execution::operator()(const syntax::For& loop) {
  const auto step = evaluator_.number(loop.step);
  if (step && *step == 0) {
    warn("the step of $FOR is 0: the loop never ends by itself");
  }
  return evaluator_.evaluate(loop.start)
      .and_then([&](const Value& start) { return evaluator_.write(loop.counter, start); })
      .and_then([&] { return enter_loop(loop, state_.frame().position); });
}

Result<Outcome> Execution::operator()(const syntax::EndFor& end) {
  const auto& loop = std::get<syntax::For>(state_.frame().routine->operations[end.loop].statement);
  return evaluator_.evaluate(loop.step)
      .and_then([&](const Value& step) {
        return change(loop.counter, values::BinaryOperator::add, step);
      })
      .and_then([&] { return enter_loop(loop, end.loop); });
}

// The counter is tested before each pass; with a step of 0 it never passes the end.
Result<Outcome> Execution::enter_loop(const syntax::For& loop, std::size_t begin) {
  const auto counter = evaluator_.read(loop.counter).and_then(values::number);
  const auto end = counter ? evaluator_.number(loop.end) : counter;
  const auto step = end ? evaluator_.number(loop.step) : end;
  return step.map([&](double by) {
    const bool over = (by > 0 && *counter > *end) || (by < 0 && *counter < *end);
    return go_to(over ? loop.exit : begin + 1);
  });
}

Result<Outcome> Execution::operator()(const syntax::Switch& selection) {
  const auto selector = evaluator_.number(selection.selector);
  if (!selector) {
    return tl::make_unexpected(selector.error());
  }
  for (const syntax::SwitchCase& candidate : selection.cases) {
    const auto value = evaluator_.number(candidate.value);
    if (!value) {
      return tl::make_unexpected(value.error());
    }
    if (std::abs(*value - *selector) < same_case) {
      return go_to(candidate.target);
    }
  }
  return go_to(selection.otherwise);
}

Result<Outcome> Execution::operator()(const syntax::Goto& jump) {
  if (const auto* number = std::get_if<syntax::Expression>(&jump.target)) {
    return evaluator_.integer(*number).and_then([this](long n) { return go_to_number(n); });
  }
  return evaluator_.name_of(std::get<syntax::Name>(jump.target))
      .and_then([this](const std::string& name) { return go_to_label(name); });
}

Result<Outcome> Execution::go_to_number(long number) {
  const auto& numbers = state_.frame().routine->numbers;
  const auto target = numbers.find(number);
  if (target == numbers.end()) {
    return fault(0, "$GOTO to N" + std::to_string(number) +
                        ", but no block of this routine begins with that number and a colon");
  }
  return go_to(target->second);
}

Result<Outcome> Execution::go_to_label(const std::string& label) {
  const auto& labels = state_.frame().routine->labels;
  const auto target = labels.find(label);
  if (target == labels.end()) {
    return fault(0, "$GOTO to [" + label + "], which is nowhere in this routine");
  }
  return go_to(target->second);
}

}  // namespace millrace::cnc::nc::run
