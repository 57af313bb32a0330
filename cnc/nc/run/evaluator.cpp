#include "cnc/nc/run/evaluator.hpp"

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

Value Evaluator::value_of(const syntax::Missing& /*missing*/) {
  fail(0, "the block has a mistake");
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
    case syntax::QueryKind::has_function:
      return truth(integer(*query.argument) >= 0);  // The virtual CNC has all of them.
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
  const long dimension = query.argument ? integer(*query.argument) : 1;
  const auto info = scope_.memory.find(name_of(*query.subject));
  const bool known = info && dimension >= 1 &&
                     static_cast<std::size_t>(dimension) <= info->shape.dimensions.size();
  return known
             ? static_cast<double>(info->shape.dimensions[static_cast<std::size_t>(dimension) - 1])
             : -1.0;
}

// Names: resolved, read and written.

Value Evaluator::read(const syntax::Reference& reference) {
  return std::visit([this](const auto& node) { return value_of(node); }, reference);
}

void Evaluator::write(const syntax::Reference& reference, const Value& value) {
  const std::string name = name_of(reference);
  if (Memory::owns(name)) {
    must(scope_.memory.assign(name, value));
  } else if (name.starts_with("SD.")) {
    fail(0, name + " is system data, which are assigned with SSD");
  } else if (scope_.system.read(name)) {
    fail(0, name + " can only be read");
  } else {
    must(scope_.environment.write(name, value));
  }
}

values::Result<Value> Evaluator::read_variable(const std::string& name) const {
  if (Memory::owns(name)) {
    return scope_.memory.read(name);
  }
  if (const auto value = scope_.system.read(name)) {
    return *value;
  }
  return scope_.environment.read(name);
}

Value Evaluator::value_of(const syntax::Parameter& parameter) {
  return must(scope_.memory.read(resolve(parameter)));
}

Value Evaluator::value_of(const syntax::Variable& variable) {
  return must(read_variable(resolve(variable)));
}

Value Evaluator::value_of(const syntax::CycleParameter& parameter) {
  const long number = integer(*parameter.number);
  const Value* const value = scope_.memory.cycle_argument(number);
  if (value == nullptr) {
    fail(0, "@P" + std::to_string(number) + " was not passed; ask with EXIST[@P" +
                std::to_string(number) + "]");
  }
  return *value;
}

std::string Evaluator::name_of(const syntax::Reference& reference) {
  return std::visit([this](const auto& node) { return resolve(node); }, reference);
}

std::string Evaluator::name_of(const syntax::Name& name) {
  if (const auto* variable = std::get_if<syntax::Variable>(&name)) {
    return must(values::text(value_of(*variable)));
  }
  const auto& written = std::get<std::string>(name);
  return scope_.macros.contains(written) ? scope_.macros.text(written) : written;
}

// P2 = 7 makes PP2 the parameter P7.
std::string Evaluator::resolve(const syntax::Parameter& parameter) {
  long index = integer(*parameter.index);
  for (int level = 0; level < parameter.indirections; ++level) {
    index = must(scope_.memory.read("P" + std::to_string(index)).and_then(values::integer));
  }
  if (index < 1) {
    fail(0, "P" + std::to_string(index) + ": parameters are numbered from 1");
  }
  return "P" + std::to_string(index) + indices_of(parameter.elements);
}

std::string Evaluator::resolve(const syntax::Variable& variable) {
  std::string name;
  for (const syntax::VariablePart& part : variable.parts) {
    name += (name.empty() ? "" : ".") + part.name + indices_of(part.elements);
  }
  return name;
}

std::string Evaluator::resolve(const syntax::CycleParameter& /*parameter*/) {
  fail(0, "the parameters of a cycle, written with @, can only be read");
}

std::string Evaluator::indices_of(const std::vector<syntax::Expression>& elements) {
  std::string indices;
  for (const syntax::Expression& element : elements) {
    indices += '[' + std::to_string(integer(element)) + ']';
  }
  return indices;
}

}  // namespace millrace::cnc::nc::run
