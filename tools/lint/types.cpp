#include "tools/lint/types.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "cnc/nc/environment.hpp"
#include "cnc/nc/values/format.hpp"
#include "cnc/nc/values/operations.hpp"
#include "fabric/cases.hpp"

namespace millrace::tools::lint {

namespace {

using cnc::nc::values::BinaryOperator;
using cnc::nc::values::Function;
using fabric::Cases;

enum class Type : std::uint8_t { unknown, number, text };

constexpr std::string_view needs_text =
    "a text is needed here: convert with INT_TO_STR or REAL_TO_STR";
constexpr std::string_view needs_number =
    "a number is needed here: convert with STR_TO_INT or STR_TO_REAL";

bool gives_text(const Function& function) {
  constexpr std::array<std::string_view, 8> names{"LEFT",   "MID",     "RIGHT",      "CHR",
                                                  "DELETE", "REPLACE", "INT_TO_STR", "REAL_TO_STR"};
  return std::ranges::count(names, function.name) > 0 || function.name == "INSERT";
}

/// The type of its first argument.
Type takes(const Function& function) {
  constexpr std::array<std::string_view, 3> of_numbers{"CHR", "INT_TO_STR", "REAL_TO_STR"};
  const bool text = cnc::nc::values::is_string_function(function) &&
                    std::ranges::count(of_numbers, function.name) == 0;
  return text ? Type::text : Type::number;
}

Type type_of_member(std::string_view member) {
  if (member == "REQUEST_STATE" || member == "RESPONSE_STATE") {
    return Type::number;
  }
  return member == "UUID" || member == "REQUEST" || member == "RESPONSE" ? Type::text
                                                                         : Type::unknown;
}

class Checker {
 public:
  Checker(const std::set<std::string>& macros, std::vector<std::string>& mistakes)
      : macros_(macros), mistakes_(mistakes) {}

  /// Checks an expression and returns its type.
  Type check(const syntax::Expression& expression) {
    return std::visit(Cases{[](const syntax::Missing&) { return Type::unknown; },
                            [](const syntax::Number&) { return Type::number; },
                            [&](const syntax::Text& text) {
                              return macros_.contains(text.text) ? Type::unknown : Type::text;
                            },
                            [&](const syntax::Unary& unary) {
                              expect(*unary.operand, Type::number, "an operator");
                              return Type::number;
                            },
                            [&](const syntax::Binary& binary) { return check(binary); },
                            [&](const syntax::Call& call) { return check(call); },
                            [](const syntax::Parameter&) { return Type::number; },
                            [&](const syntax::Variable& variable) { return check(variable); },
                            [](const syntax::CycleParameter&) { return Type::unknown; },
                            [](const syntax::Query&) { return Type::number; }},
                      expression.node);
  }

  /// Checks a place where only values of one type are allowed.
  void expect(const syntax::Expression& expression, Type type, std::string_view where) {
    const Type found = check(expression);
    if (found != Type::unknown && found != type && concerns(expression)) {
      mistake(expression, found, where, type);
    }
  }

  void assign(const syntax::Assignment& assignment) {
    const auto* const variable = std::get_if<syntax::Variable>(&assignment.target);
    const std::string_view member =
        variable == nullptr ? std::string_view() : service_part(*variable);
    for_service_ = !member.empty();
    const Type value = check(assignment.value);
    for_service_ = false;
    const Type target = std::holds_alternative<syntax::Parameter>(assignment.target)
                            ? Type::number
                            : type_of_member(member);
    if (target == Type::unknown || value == Type::unknown || target == value) {
      return;
    }
    if (member.empty()) {
      expect(assignment.value, target, "a parameter");
      return;
    }
    mistakes_.push_back(
        fmt::format("{} is a {}, and a {} is assigned to it; the program would end "
                    "here with error {}: {}",
                    member, name_of(target), name_of(value), error_of(target),
                    target == Type::text ? needs_text : needs_number));
  }

  void message(const syntax::FormattedText& text) {
    const auto pieces = cnc::nc::values::parse_format(text.format);
    std::vector<char> letters;
    if (pieces) {
      for (const auto& piece : *pieces) {
        if (piece.conversion != 0) {
          letters.push_back(piece.conversion);
        }
      }
    }
    for (std::size_t i = 0; i < text.values.size(); ++i) {
      // %s shows numbers too.
      if (i < letters.size() && letters[i] != 's') {
        expect(text.values[i], Type::number, fmt::format("%{}", letters[i]));
      } else {
        check(text.values[i]);
      }
    }
  }

 private:
  static std::string_view name_of(Type type) { return type == Type::text ? "text" : "number"; }
  /// IB/tf5200_diagnosis: string expected, number expected (documented).
  static int error_of(Type wanted) { return wanted == Type::text ? 21460 : 21461; }

  static bool is_service(const syntax::Expression& expression) {
    return std::visit(
        Cases{[](const syntax::Variable& variable) { return !service_part(variable).empty(); },
              [](const syntax::Binary& binary) {
                return is_service(*binary.left) || is_service(*binary.right);
              },
              [](const syntax::Unary& unary) { return is_service(*unary.operand); },
              [](const syntax::Call& call) {
                return std::ranges::any_of(call.arguments, is_service);
              },
              [](const auto&) { return false; }},
        expression.node);
  }
  [[nodiscard]] bool concerns(const syntax::Expression& expression) const {
    return for_service_ || is_service(expression);
  }

  Type check(const syntax::Variable& variable) {
    for (const syntax::VariablePart& part : variable.parts) {
      for (const syntax::Expression& element : part.elements) {
        expect(element, Type::number, "an index");
      }
    }
    return type_of_member(service_part(variable));
  }

  Type check(const syntax::Call& call) {
    for (std::size_t i = 0; i < call.arguments.size(); ++i) {
      if (i == 0) {
        expect(call.arguments[i], takes(*call.function), call.function->name);
      } else {
        check(call.arguments[i]);
      }
    }
    return gives_text(*call.function) ? Type::text : Type::number;
  }

  Type check(const syntax::Binary& binary) {
    const Type left = check(*binary.left);
    const Type right = check(*binary.right);
    const bool service = concerns(*binary.left) || concerns(*binary.right);
    const bool joins = binary.operation == BinaryOperator::add;
    const bool compares = binary.operation == BinaryOperator::equal ||
                          binary.operation == BinaryOperator::not_equal ||
                          binary.operation == BinaryOperator::less ||
                          binary.operation == BinaryOperator::less_or_equal ||
                          binary.operation == BinaryOperator::greater ||
                          binary.operation == BinaryOperator::greater_or_equal;
    if (service && (joins || compares) && left != Type::unknown && right != Type::unknown &&
        left != right) {
      mistakes_.push_back(fmt::format(
          "a {} and a {} are {}; the program would end here with error {}: convert numbers with "
          "INT_TO_STR or REAL_TO_STR, texts with STR_TO_INT or STR_TO_REAL",
          name_of(left), name_of(right), joins ? "added" : "compared", error_of(left)));
      return Type::unknown;
    }
    if (!joins && !compares) {
      report_text(*binary.left, left);
      report_text(*binary.right, right);
    }
    return joins ? (left == Type::unknown ? right : left) : Type::number;
  }

  void report_text(const syntax::Expression& operand, Type type) {
    if (type == Type::text && concerns(operand)) {
      mistake(operand, type, "an operator", Type::number);
    }
  }

  void mistake(const syntax::Expression& expression, Type found, std::string_view where,
               Type wanted) {
    const auto* const variable = std::get_if<syntax::Variable>(&expression.node);
    mistakes_.push_back(fmt::format(
        "{} stands at {}, and is a {}; the program would end here with "
        "error {}: {}",
        variable == nullptr ? "this value" : service_part(*variable), where, name_of(found),
        error_of(wanted), wanted == Type::text ? needs_text : needs_number));
  }

  const std::set<std::string>& macros_;
  std::vector<std::string>& mistakes_;
  /// The expression is assigned to a member of V.G.SERVICE.
  bool for_service_ = false;
};

void collect_macros(const syntax::Routine& routine, std::set<std::string>& macros) {
  for (const syntax::Operation& operation : routine.operations) {
    const auto* const words = std::get_if<syntax::Words>(&operation.statement);
    for (std::size_t i = 0; words != nullptr && i < words->items.size(); ++i) {
      if (const auto* const macro = std::get_if<syntax::MacroDefinition>(&words->items[i])) {
        macros.insert(macro->name);
      }
    }
  }
}

}  // namespace

Types::Types(const syntax::Program& program) {
  collect_macros(program.main, macros_);
  for (const auto& [name, routine] : program.subprograms) {
    collect_macros(routine, macros_);
  }
}

std::vector<std::string> Types::mistakes(const syntax::Statement& statement) const {
  std::vector<std::string> found;
  Checker checker(macros_, found);
  std::visit(Cases{[&](const syntax::Words& words) {
                     for (const syntax::WordsItem& item : words.items) {
                       std::visit(Cases{[&](const syntax::Word& word) {
                                          checker.expect(word.value, Type::number, word.address);
                                        },
                                        [&](const syntax::Assignment& assignment) {
                                          checker.assign(assignment);
                                        },
                                        [&](const syntax::DataAssignment& data_assignment) {
                                          checker.check(data_assignment.value);
                                        },
                                        [&](const syntax::QueueMessage& queue_message) {
                                          checker.check(queue_message.value);
                                        },
                                        [](const auto&) {}},
                                  item);
                     }
                   },
                   [&](const syntax::Branch& branch) {
                     checker.expect(branch.condition, Type::number, "a condition");
                   },
                   [&](const syntax::WaitFor& wait) {
                     checker.expect(wait.condition, Type::number, "a condition");
                   },
                   [&](const syntax::Switch& branch) {
                     checker.expect(branch.selector, Type::number, "$SWITCH");
                     for (const syntax::SwitchCase& each : branch.cases) {
                       checker.expect(each.value, Type::number, "$CASE");
                     }
                   },
                   [&](const syntax::For& loop) {
                     checker.expect(loop.start, Type::number, "$FOR");
                     checker.expect(loop.end, Type::number, "$FOR");
                     checker.expect(loop.step, Type::number, "$FOR");
                   },
                   [&](const syntax::Message& message) { checker.message(message.text); },
                   [&](const syntax::SaveMessage& message) { checker.message(message.text); },
                   [&](const syntax::TimeCommand& time) {
                     checker.expect(time.seconds, Type::number, "#TIME");
                   },
                   [](const auto&) {}},
             statement);
  return found;
}

namespace {

using cnc::nc::Value;
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
