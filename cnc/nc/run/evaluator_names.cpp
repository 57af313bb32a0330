// The part of the evaluator for names: resolves, reads and writes them.
#include "cnc/nc/run/evaluator.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {

using values::fail;
using values::must;
using values::Result;

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

Result<Value> Evaluator::read_variable(const std::string& name) const {
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
