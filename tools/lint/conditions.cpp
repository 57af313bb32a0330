#include "tools/lint/conditions.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "cnc/nc/environment.hpp"
#include "cnc/nc/values/operators.hpp"
#include "fabric/cases.hpp"

namespace millrace::tools::lint {

namespace {

using cnc::nc::Value;
using cnc::nc::values::BinaryOperator;
using fabric::Cases;
using Known = std::optional<Value>;

std::optional<bool> logical(const Known& value) {
  const auto* const number = value ? std::get_if<double>(&*value) : nullptr;
  return number == nullptr ? std::nullopt : std::optional(std::abs(*number) >= 0.5);
}

/// Evaluates what can be known without running the program.
class Evaluator {
 public:
  explicit Evaluator(double state) : state_(state) {}

  Known of(const syntax::Expression& expression) const {
    return std::visit(Cases{[](const syntax::Number& number) { return Known(number.value); },
                            [&](const syntax::Unary& unary) { return of(unary); },
                            [&](const syntax::Binary& binary) { return of(binary); },
                            [&](const syntax::Call& call) { return of(call); },
                            [&](const syntax::Variable& variable) {
                              return service_part(variable) == "RESPONSE_STATE" ? Known(state_)
                                                                                : Known();
                            },
                            [](const auto&) { return Known(); }},
                      expression.node);
  }

 private:
  Known of(const syntax::Unary& unary) const {
    const Known operand = of(*unary.operand);
    if (unary.operation == syntax::UnaryOperator::logical_not) {
      const auto truth = logical(operand);
      return truth ? Known(*truth ? 0.0 : 1.0) : Known();
    }
    const auto* const number = operand ? std::get_if<double>(&*operand) : nullptr;
    return number == nullptr ? Known() : Known(-*number);
  }

  Known of(const syntax::Binary& binary) const {
    const Known left = of(*binary.left);
    const Known right = of(*binary.right);
    const bool all = binary.operation == BinaryOperator::logical_and;
    if (all || binary.operation == BinaryOperator::logical_or) {
      // One side may decide alone.
      for (const auto& truth : {logical(left), logical(right)}) {
        if (truth && *truth != all) {
          return Value(all ? 0.0 : 1.0);
        }
      }
    }
    if (!left || !right) {
      return {};
    }
    const auto value = cnc::nc::values::apply(binary.operation, *left, *right);
    return value ? Known(*value) : Known();
  }

  Known of(const syntax::Call& call) const {
    std::vector<Value> arguments;
    for (const syntax::Expression& each : call.arguments) {
      const Known value = of(each);
      if (!value) {
        return {};
      }
      arguments.push_back(*value);
    }
    const auto value = call.function->call(arguments);
    return value ? Known(*value) : Known();
  }

  double state_;
};

void collect_numbers(const syntax::Expression& expression, std::vector<double>& numbers) {
  std::visit(Cases{[&](const syntax::Number& number) { numbers.push_back(number.value); },
                   [&](const syntax::Unary& unary) { collect_numbers(*unary.operand, numbers); },
                   [&](const syntax::Binary& binary) {
                     collect_numbers(*binary.left, numbers);
                     collect_numbers(*binary.right, numbers);
                   },
                   [](const auto&) {}},
             expression.node);
}

}  // namespace

std::optional<bool> truth_at(const syntax::Expression& condition, syntax::ConditionRule rule,
                             double state) {
  const Known value = Evaluator(state).of(condition);
  const auto* const number = value ? std::get_if<double>(&*value) : nullptr;
  if (number == nullptr) {
    return std::nullopt;
  }
  switch (rule) {
    case syntax::ConditionRule::half_or_beyond:
      return std::abs(*number) >= 0.5;
    case syntax::ConditionRule::above_half:
      return *number > 0.5;
    case syntax::ConditionRule::half_or_above:
      return *number >= 0.5;
  }
  return std::nullopt;
}

bool can_be_true(const syntax::Expression& condition, syntax::ConditionRule rule) {
  constexpr double greatest_state = 4294967295.0;
  // Comparisons change their result only next to the numbers in them.
  std::vector<double> states{1, 2, 99, 1e6, greatest_state};
  std::vector<double> numbers;
  collect_numbers(condition, numbers);
  for (const double number : numbers) {
    for (const double near : {std::floor(number) - 1, std::floor(number), std::floor(number) + 1,
                              std::floor(number) + 2}) {
      if (near >= 1 && near <= greatest_state) {
        states.push_back(near);
      }
    }
  }
  return std::ranges::any_of(
      states, [&](double state) { return truth_at(condition, rule, state).value_or(true); });
}

std::string_view service_part(const syntax::Variable& variable) {
  const auto& parts = variable.parts;
  const bool is_service = parts.size() == 4 && parts[1].name == "G" && parts[2].name == "SERVICE";
  return is_service ? std::string_view(parts[3].name) : std::string_view();
}

}  // namespace millrace::tools::lint
