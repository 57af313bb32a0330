#include "cnc/simulator/axis_variables.hpp"

#include <cassert>
#include <memory>
#include <utility>

#include <fmt/format.h>

namespace millrace::cnc::simulator {

namespace {

Variable::Computed value_of(std::string_view quantity, const AxisSettings& axis, std::size_t slot,
                            const std::function<double(std::size_t)>& position) {
  if (quantity == "V.A.-SWE") {
    return [limit = axis.negative_limit](std::uint32_t) { return nc::Value{limit}; };
  }
  if (quantity == "V.A.+SWE") {
    return [limit = axis.positive_limit](std::uint32_t) { return nc::Value{limit}; };
  }
  return [position, slot](std::uint32_t) { return nc::Value{position(slot)}; };
}

}  // namespace

void add_axis_variables(Family& family, const std::vector<AxisSettings>& axes,
                        const std::function<double(std::size_t)>& position) {
  for (const std::string_view quantity : axis_quantities) {
    for (std::size_t slot = 0; slot < axes.size(); ++slot) {
      Declaration declaration{fmt::format("{}.{}", quantity, axes[slot].name),
                              ElementType::number(Type::real64), Access::read_only};
      declaration.axis = axes[slot].name.size() + 1;
      family.add(std::make_shared<Variable>(std::move(declaration),
                                            value_of(quantity, axes[slot], slot, position)));
    }
  }
}

namespace {

/// A read-only variable keeps its configured value.
std::shared_ptr<Variable> system_variable(Declaration declaration, const nc::Value& value) {
  if (declaration.access == Access::read_only) {
    return std::make_shared<Variable>(std::move(declaration),
                                      [value](std::uint32_t) { return value; });
  }
  auto variable = std::make_shared<Variable>(std::move(declaration));
  for (std::uint32_t element = 0; element < variable->declaration().elements(); ++element) {
    [[maybe_unused]] const auto assigned = variable->assign(element, value);
    assert(assigned.has_value());
  }
  return variable;
}

}  // namespace

void add_system_variables(Store& store, const std::vector<SystemVariable>& variables,
                          const std::vector<AxisSettings>& axes) {
  for (const SystemVariable& variable : variables) {
    const bool of_axes = variable.declaration.name.starts_with(prefix_of(Kind::axis));
    Family& family = store.family(of_axes ? Kind::axis : Kind::global);
    if (!variable.per_axis) {
      family.add(system_variable(variable.declaration, variable.value));
      continue;
    }
    for (const AxisSettings& axis : axes) {
      Declaration declaration = variable.declaration;
      declaration.name += "." + axis.name;
      declaration.axis = axis.name.size() + 1;
      declaration.behind += declaration.dimensions.empty() ? 0 : declaration.axis;
      family.add(system_variable(std::move(declaration), variable.value));
    }
  }
}

}  // namespace millrace::cnc::simulator
