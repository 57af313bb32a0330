#include "cnc/nc/run/variable_table.hpp"

#include <algorithm>
#include <charconv>
#include <iterator>

#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {
namespace {

using values::fault;
using values::Result;

// Limit of one table. The vendor's limits are settings; these are our choice.
constexpr std::size_t most_elements = 20'000;

std::size_t elements_of(const VariableShape& shape) {
  std::size_t elements = 1;
  for (const std::size_t dimension : shape.dimensions) {
    elements = std::min(elements * std::min(dimension, most_elements + 1), most_elements + 1);
  }
  return elements;
}

}  // namespace

ElementName split_name(std::string_view name) {
  ElementName element{name, {}};
  while (element.variable.ends_with(']')) {
    const std::size_t open = element.variable.rfind('[');
    long index = 0;
    const char* end = element.variable.data() + element.variable.size() - 1;
    if (open == std::string_view::npos) {
      return element;
    }
    const auto read = std::from_chars(element.variable.data() + open + 1, end, index);
    if (read.ptr != end || read.ec != std::errc{}) {
      return element;
    }
    element.indices.insert(element.indices.begin(), index);
    element.variable = element.variable.substr(0, open);
  }
  return element;
}

Result<void> VariableTable::declare(const std::string& name, const VariableShape& shape,
                                    std::span<const Value> initial) {
  const auto existing = variables_.find(name);
  if (existing != variables_.end() && existing->second.shape != shape) {
    return fault(0, name + " exists already as " + values::type_name(existing->second.shape) +
                        "; delete it with #DELETE first");
  }
  const std::size_t elements = elements_of(shape);
  const std::size_t added = existing == variables_.end() ? elements : 0;
  if (elements == 0 || elements_ + added > most_elements) {
    return fault(0, "no room for " + name + ": all variables of its kind have at most " +
                        std::to_string(most_elements) + " elements together");
  }
  if (initial.size() > elements) {
    return fault(0, name + " has " + std::to_string(elements) + " elements, but " +
                        std::to_string(initial.size()) + " values are given");
  }
  Variable variable = existing != variables_.end()
                          ? existing->second
                          : Variable{shape, {elements, values::initial_value(shape)}};
  for (std::size_t i = 0; i < initial.size(); ++i) {
    auto value = values::fit(shape, initial[i]);
    if (!value) {
      return fault(value.error().id, name + ": " + value.error().text);
    }
    variable.elements[i] = std::move(*value);
  }
  variables_.insert_or_assign(name, std::move(variable));
  elements_ += added;
  return {};
}

// Row by row, as the initialisers are written.
Result<std::size_t> VariableTable::position(const Variable& variable, const ElementName& name) {
  const std::vector<std::size_t>& dimensions = variable.shape.dimensions;
  if (name.indices.size() != dimensions.size()) {
    return fault(0, std::string(name.variable) + " has " + std::to_string(dimensions.size()) +
                        " dimensions, not " + std::to_string(name.indices.size()));
  }
  std::size_t position = 0;
  for (std::size_t i = 0; i < dimensions.size(); ++i) {
    const long index = name.indices[i];
    if (index < 0 || static_cast<std::size_t>(index) >= dimensions[i]) {
      return fault(0, std::string(name.variable) + ": the index " + std::to_string(index) +
                          " is not between 0 and " + std::to_string(dimensions[i] - 1));
    }
    position = position * dimensions[i] + static_cast<std::size_t>(index);
  }
  return position;
}

Result<Value> VariableTable::read(std::string_view name) const {
  const ElementName element = split_name(name);
  const auto found = variables_.find(element.variable);
  if (found == variables_.end()) {
    return fault(0, std::string(element.variable) + " does not exist");
  }
  return position(found->second, element).map([&](std::size_t i) {
    return found->second.elements[i];
  });
}

Result<void> VariableTable::write(std::string_view name, const Value& value) {
  const ElementName element = split_name(name);
  const auto found = variables_.find(element.variable);
  if (found == variables_.end()) {
    return fault(0, std::string(element.variable) + " does not exist");
  }
  return position(found->second, element).and_then([&](std::size_t i) {
    return values::fit(found->second.shape, value).map([&](Value fitting) {
      found->second.elements[i] = std::move(fitting);
    });
  });
}

bool VariableTable::contains(std::string_view name) const {
  const ElementName element = split_name(name);
  const auto found = variables_.find(element.variable);
  return found != variables_.end() &&
         (element.indices.empty() || position(found->second, element).has_value());
}

bool VariableTable::erase(std::string_view name) {
  const auto found = variables_.find(name);
  if (found == variables_.end()) {
    return false;
  }
  elements_ -= found->second.elements.size();
  variables_.erase(found);
  return true;
}

void VariableTable::clear() {
  variables_.clear();
  elements_ = 0;
}

std::optional<VariableInfo> VariableTable::info(std::size_t index) const {
  if (index >= variables_.size()) {
    return std::nullopt;
  }
  const auto variable = std::next(variables_.begin(), static_cast<std::ptrdiff_t>(index));
  return VariableInfo{variable->first, variable->second.shape};
}

std::optional<VariableInfo> VariableTable::find(std::string_view name) const {
  const auto found = variables_.find(split_name(name).variable);
  if (found == variables_.end()) {
    return std::nullopt;
  }
  return VariableInfo{found->first, found->second.shape};
}

}  // namespace millrace::cnc::nc::run
