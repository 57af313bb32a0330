// The part of the evaluator for names: resolves, reads and writes them.
#include "cnc/nc/run/evaluator.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {

using values::fault;
using values::Result;

Result<Value> Evaluator::read(const syntax::Reference& reference) {
  return std::visit([this](const auto& node) { return value_of(node); }, reference);
}

Result<void> Evaluator::write(const syntax::Reference& reference, const Value& value) {
  return name_of(reference).and_then([&](const std::string& name) -> Result<void> {
    if (Memory::owns(name)) {
      return scope_.memory.assign(name, value);
    }
    if (name.starts_with("SD.")) {
      return fault(0, name + " is system data, which are assigned with SSD");
    }
    if (scope_.system.read(name)) {
      return fault(0, name + " can only be read");
    }
    return scope_.environment.write(name, value);
  });
}

Result<Value> Evaluator::read_variable(const std::string& name) {
  if (Memory::owns(name)) {
    return scope_.memory.read(name);
  }
  if (const auto value = scope_.system.read(name)) {
    return *value;
  }
  return scope_.environment.read(name);
}

Result<Value> Evaluator::value_of(const syntax::Parameter& parameter) {
  return resolve(parameter).and_then(
      [this](const std::string& name) { return scope_.memory.read(name); });
}

Result<Value> Evaluator::value_of(const syntax::Variable& variable) {
  return resolve(variable).and_then(
      [this](const std::string& name) { return read_variable(name); });
}

Result<Value> Evaluator::value_of(const syntax::CycleParameter& parameter) {
  return integer(*parameter.number).and_then([this](long number) -> Result<Value> {
    if (const Value* value = scope_.memory.cycle_argument(number)) {
      return *value;
    }
    return fault(0, "@P" + std::to_string(number) + " was not passed; ask with EXIST[@P" +
                        std::to_string(number) + "]");
  });
}

Result<std::string> Evaluator::name_of(const syntax::Reference& reference) {
  return std::visit([this](const auto& node) { return resolve(node); }, reference);
}

Result<std::string> Evaluator::name_of(const syntax::Name& name) {
  if (const auto* variable = std::get_if<syntax::Variable>(&name)) {
    return value_of(*variable).and_then(values::text);
  }
  const auto& written = std::get<std::string>(name);
  return scope_.macros.contains(written) ? scope_.macros.text(written) : written;
}

// P2 = 7 makes PP2 the parameter P7.
Result<std::string> Evaluator::resolve(const syntax::Parameter& parameter) {
  auto index = integer(*parameter.index);
  for (int level = 0; index && level < parameter.indirections; ++level) {
    index = scope_.memory.read("P" + std::to_string(*index)).and_then(values::integer);
  }
  if (!index) {
    return tl::make_unexpected(index.error());
  }
  if (*index < 1) {
    return fault(0, "P" + std::to_string(*index) + ": parameters are numbered from 1");
  }
  std::string name = "P" + std::to_string(*index);
  return append_elements(parameter.elements, name).map([&] { return name; });
}

Result<std::string> Evaluator::resolve(const syntax::Variable& variable) {
  std::string name;
  for (const syntax::VariablePart& part : variable.parts) {
    name += name.empty() ? part.name : '.' + part.name;
    if (auto appended = append_elements(part.elements, name); !appended) {
      return tl::make_unexpected(appended.error());
    }
  }
  return name;
}

Result<std::string> Evaluator::resolve(const syntax::CycleParameter& /*parameter*/) {
  return fault(0, "the parameters of a cycle, written with @, can only be read");
}

Result<void> Evaluator::append_elements(const std::vector<syntax::Expression>& elements,
                                        std::string& name) {
  for (const syntax::Expression& element : elements) {
    const auto index = integer(element);
    if (!index) {
      return tl::make_unexpected(index.error());
    }
    name += '[' + std::to_string(*index) + ']';
  }
  return {};
}

}  // namespace millrace::cnc::nc::run
