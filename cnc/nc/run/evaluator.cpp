#include "cnc/nc/run/evaluator.hpp"

#include <algorithm>
#include <vector>

#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fault;
using values::Result;

constexpr int most_uses_of_macros = 1'000;

bool works_on_strings(values::BinaryOperator operation) {
  return operation == values::BinaryOperator::add ||
         (operation >= values::BinaryOperator::equal &&
          operation <= values::BinaryOperator::greater_or_equal);
}

bool is_string(const Value& value) {
  return std::holds_alternative<std::string>(value);
}

}  // namespace

Result<Value> Evaluator::evaluate(const syntax::Expression& expression) {
  return std::visit([this](const auto& node) { return value_of(node); }, expression.node);
}

Result<Value> Evaluator::evaluate_text(const syntax::Expression& expression) {
  const auto* text = std::get_if<syntax::Text>(&expression.node);
  return text != nullptr ? Result<Value>(text->text) : evaluate(expression);
}

Result<double> Evaluator::number(const syntax::Expression& expression) {
  return evaluate(expression).and_then(values::number);
}

Result<long> Evaluator::integer(const syntax::Expression& expression) {
  return evaluate(expression).and_then(values::integer);
}

bool Evaluator::is_macro(const syntax::Expression& expression) const {
  const auto* text = std::get_if<syntax::Text>(&expression.node);
  return text != nullptr && scope_.macros.contains(text->text);
}

Result<void> Evaluator::count_macro(const std::string& name) {
  if (++macros_used_ > most_uses_of_macros) {
    return fault(0, "the block uses more than " + std::to_string(most_uses_of_macros) +
                        " macros in macros; the last is \"" + name + '"');
  }
  return {};
}

Result<Value> Evaluator::value_of(const syntax::Number& number) {
  return number.value;
}

Result<Value> Evaluator::value_of(const syntax::Text& text) {
  if (!scope_.macros.contains(text.text)) {
    return text.text;
  }
  if (auto counted = count_macro(text.text); !counted) {
    return tl::make_unexpected(counted.error());
  }
  if (macro_depth_ == deepest_macro) {
    return fault(0, "macros are nested deeper than " + std::to_string(deepest_macro) +
                        " levels, or \"" + text.text + "\" uses itself");
  }
  const auto expression = scope_.macros.expression(text.text);
  if (!expression) {
    return tl::make_unexpected(expression.error());
  }
  ++macro_depth_;
  auto value = evaluate(**expression);
  --macro_depth_;
  return value;
}

Result<Value> Evaluator::value_of(const syntax::Unary& unary) {
  return number(*unary.operand).map([&](double operand) -> Value {
    return unary.operation == syntax::UnaryOperator::minus ? -operand
                                                           : (values::is_true(operand) ? 0.0 : 1.0);
  });
}

// Beside a string, a quoted text is a string even if a macro has its name: V.P.NAME == "AXIS"
// compares with the text AXIS.
Result<Value> Evaluator::value_of(const syntax::Binary& binary) {
  auto left = evaluate_text(*binary.left);
  auto right = left ? evaluate_text(*binary.right) : left;
  if (!left || !right) {
    return left ? right : left;
  }
  const bool left_macro = is_macro(*binary.left);
  const bool right_macro = is_macro(*binary.right);
  const bool strings = works_on_strings(binary.operation) &&
                       ((is_string(*left) && !left_macro) || (is_string(*right) && !right_macro));
  if (!strings && left_macro) {
    left = evaluate(*binary.left);
  }
  if (!strings && right_macro) {
    right = evaluate(*binary.right);
  }
  if (!left || !right) {
    return left ? right : left;
  }
  return values::apply(binary.operation, *left, *right);
}

Result<Value> Evaluator::value_of(const syntax::Call& call) {
  const bool strings = values::is_string_function(*call.function);
  std::vector<Value> arguments;
  arguments.reserve(call.arguments.size());
  for (const syntax::Expression& expression : call.arguments) {
    auto argument = strings ? evaluate_text(expression) : evaluate(expression);
    if (!argument) {
      return argument;
    }
    arguments.push_back(std::move(*argument));
  }
  return call.function->call(arguments);
}

Result<Value> Evaluator::value_of(const syntax::Query& query) {
  switch (query.kind) {
    case syntax::QueryKind::exists:
      return exists(*query.subject).map([](bool there) -> Value { return there ? 1.0 : 0.0; });
    case syntax::QueryKind::size_of:
      return size_of(query).map([](double size) -> Value { return size; });
    default:
      return read(*query.subject).map([&](const Value& value) -> Value {
        return is_string(value) == (query.kind == syntax::QueryKind::is_string) ? 1.0 : 0.0;
      });
  }
}

Result<bool> Evaluator::exists(const syntax::Reference& reference) {
  if (const auto* parameter = std::get_if<syntax::CycleParameter>(&reference)) {
    return integer(*parameter->number).map([this](long number) {
      return scope_.memory.cycle_argument(number) != nullptr;
    });
  }
  return name_of(reference).map([this](const std::string& name) {
    return Memory::owns(name) ? scope_.memory.exists(name) : read_variable(name).has_value();
  });
}

// Elements of a dimension, counted from 1; -1 for an unknown dimension (our choice).
Result<double> Evaluator::size_of(const syntax::Query& query) {
  const auto dimension = query.dimension ? integer(*query.dimension) : Result<long>(1);
  const auto name = name_of(*query.subject);
  if (!dimension || !name) {
    return tl::make_unexpected(dimension ? name.error() : dimension.error());
  }
  const auto info = scope_.memory.find(*name);
  const bool known = info && *dimension >= 1 &&
                     static_cast<std::size_t>(*dimension) <= info->shape.dimensions.size();
  return known
             ? static_cast<double>(info->shape.dimensions[static_cast<std::size_t>(*dimension) - 1])
             : -1.0;
}

}  // namespace millrace::cnc::nc::run
