#include "cnc/nc/run/system_variables.hpp"

#include <algorithm>

#include "cnc/nc/run/variable_table.hpp"

namespace millrace::cnc::nc::run {
namespace {

// The rest of the name after a prefix; nullopt if the name does not have the prefix.
std::optional<std::string_view> behind(std::string_view prefix, std::string_view name) {
  return name.starts_with(prefix) ? std::optional(name.substr(prefix.size())) : std::nullopt;
}

}  // namespace

std::optional<double> SystemVariables::position(const std::vector<double>& positions,
                                                std::string_view axis) const {
  const auto found = std::find(axes_.begin(), axes_.end(), axis);
  if (found == axes_.end()) {
    return std::nullopt;
  }
  return positions[static_cast<std::size_t>(found - axes_.begin())];
}

std::optional<double> SystemVariables::read(std::string_view name) const {
  for (const char* prefix : {"V.A.ABS.", "V.A.WCS."}) {
    if (const auto axis = behind(prefix, name)) {
      return position(motion_.position(), *axis);
    }
  }
  if (const auto axis = behind("V.A.ACT_POS.", name)) {
    return position(interpolator_.position(), *axis);
  }
  const ElementName element = split_name(name);
  if (element.variable == "V.G.TIMER" && element.indices.size() == 1) {
    const long id = element.indices.front();
    if (id >= 0 && id < static_cast<long>(Timers::count)) {
      return timers_.latched(static_cast<std::size_t>(id));
    }
  }
  return std::nullopt;
}

}  // namespace millrace::cnc::nc::run
