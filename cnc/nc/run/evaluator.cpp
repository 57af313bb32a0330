#include "cnc/nc/run/evaluator.hpp"

#include <algorithm>
#include <vector>

#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fail;
using values::must;

constexpr int most_uses_of_macros = 1'000;

bool works_on_strings(values::BinaryOperator operation) {
  return operation == values::BinaryOperator::add ||
         (operation >= values::BinaryOperator::equal &&
          operation <= values::BinaryOperator::greater_or_equal);
}

bool is_string(const Value& value) {
  return std::holds_alternative<std::string>(value);
}

Value truth(bool value) {
  return value ? 1.0 : 0.0;
}

}  // namespace

Value Evaluator::evaluate(const syntax::Expression& expression) {
  return std::visit([this](const auto& node) { return value_of(node); }, expression.node);
}

Value Evaluator::evaluate_text(const syntax::Expression& expression) {
  const auto* text = std::get_if<syntax::Text>(&expression.node);
  return text != nullptr ? Value(text->text) : evaluate(expression);
}

double Evaluator::number(const syntax::Expression& expression) {
  return must(values::number(evaluate(expression)));
}

long Evaluator::integer(const syntax::Expression& expression) {
  return must(values::integer(evaluate(expression)));
}

bool Evaluator::is_macro(const syntax::Expression& expression) const {
  const auto* text = std::get_if<syntax::Text>(&expression.node);
  return text != nullptr && scope_.macros.contains(text->text);
}

void Evaluator::count_macro(const std::string& name) {
  if (++macros_used_ > most_uses_of_macros) {
    fail(0, "the block uses more than " + std::to_string(most_uses_of_macros) +
                " macros in macros; the last is \"" + name + '"');
  }
}

Value Evaluator::value_of(const syntax::Number& number) {
  return number.value;
}

Value Evaluator::value_of(const syntax::Text& text) {
  if (!scope_.macros.contains(text.text)) {
    return text.text;
  }
  count_macro(text.text);
  const MacroLevel level(macro_depth_, text.text);
  return evaluate(*scope_.macros.expression(text.text));
}

Value Evaluator::value_of(const syntax::Unary& unary) {
  const double operand = number(*unary.operand);
  return unary.operation == syntax::UnaryOperator::minus ? Value(-operand)
                                                         : truth(!values::is_true(operand));
}

// Beside a string, a quoted text is a string even if a macro has its name: V.P.NAME == "AXIS"
// compares with the text AXIS.
Value Evaluator::value_of(const syntax::Binary& binary) {
  Value left = evaluate_text(*binary.left);
  Value right = evaluate_text(*binary.right);
  const bool left_macro = is_macro(*binary.left);
  const bool right_macro = is_macro(*binary.right);
  const bool strings = works_on_strings(binary.operation) &&
                       ((is_string(left) && !left_macro) || (is_string(right) && !right_macro));
  if (!strings && left_macro) {
    left = evaluate(*binary.left);
  }
  if (!strings && right_macro) {
    right = evaluate(*binary.right);
  }
  return must(values::apply(binary.operation, left, right));
}

Value Evaluator::value_of(const syntax::Call& call) {
  const bool strings = values::is_string_function(*call.function);
  std::vector<Value> arguments;
  arguments.reserve(call.arguments.size());
  for (const syntax::Expression& expression : call.arguments) {
    arguments.push_back(strings ? evaluate_text(expression) : evaluate(expression));
  }
  return must(call.function->call(arguments));
}

Value Evaluator::value_of(const syntax::Query& query) {
  switch (query.kind) {
    case syntax::QueryKind::exists:
      return truth(exists(*query.subject));
    case syntax::QueryKind::size_of:
      return size_of(query);
    default:
      return truth(is_string(read(*query.subject)) == (query.kind == syntax::QueryKind::is_string));
  }
}

bool Evaluator::exists(const syntax::Reference& reference) {
  if (const auto* parameter = std::get_if<syntax::CycleParameter>(&reference)) {
    return scope_.memory.cycle_argument(integer(*parameter->number)) != nullptr;
  }
  const std::string name = name_of(reference);
  return Memory::owns(name) ? scope_.memory.exists(name) : read_variable(name).has_value();
}

// Elements of a dimension, counted from 1; -1 for an unknown dimension (our choice).
double Evaluator::size_of(const syntax::Query& query) {
  const long dimension = query.dimension ? integer(*query.dimension) : 1;
  const auto info = scope_.memory.find(name_of(*query.subject));
  const bool known = info && dimension >= 1 &&
                     static_cast<std::size_t>(dimension) <= info->shape.dimensions.size();
  return known
             ? static_cast<double>(info->shape.dimensions[static_cast<std::size_t>(dimension) - 1])
             : -1.0;
}

}  // namespace millrace::cnc::nc::run
