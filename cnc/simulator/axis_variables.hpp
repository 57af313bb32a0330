// The V.A. variables of the virtual CNC: the positions and software limits of the axes of a
// channel.
#pragma once

#include <array>
#include <functional>
#include <string_view>
#include <vector>

#include "cnc/simulator/settings.hpp"
#include "cnc/simulator/store.hpp"

namespace millrace::cnc::simulator {

/// Names without the axis. Documented in examples of the manuals (V.A.ACT_POS.X, V.A.ABS.X,
/// V.A.WCS.X, V.A.+SWE.X). Without offsets and compensations the first three have the same value.
inline constexpr std::array<std::string_view, 5> axis_quantities{"V.A.ABS", "V.A.ACT_POS",
                                                                 "V.A.WCS", "V.A.-SWE", "V.A.+SWE"};

/// Adds "V.A.ABS.X" and so on, all axes of one quantity in a row. `position` returns the position
/// in mm of the axis in a slot, from 0.
void add_axis_variables(Family& family, const std::vector<AxisSettings>& axes,
                        const std::function<double(std::size_t)>& position);

/// Adds the configured variables, one for each axis if they are per axis; each channel has its own.
void add_system_variables(Store& store, const std::vector<SystemVariable>& variables,
                          const std::vector<AxisSettings>& axes);

}  // namespace millrace::cnc::simulator
