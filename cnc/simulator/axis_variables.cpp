#include "cnc/simulator/axis_variables.hpp"

#include <memory>

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
                              ElementType::number(Type::real64),
                              Access::read_only,
                              {}};
      family.add(std::make_shared<Variable>(std::move(declaration),
                                            value_of(quantity, axes[slot], slot, position)));
    }
  }
}

}  // namespace millrace::cnc::simulator
