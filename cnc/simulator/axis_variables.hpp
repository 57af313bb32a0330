// The V.A. variables of the virtual CNC: where each axis of a channel is, and how far it may go.
#pragma once

#include <array>
#include <functional>
#include <string_view>
#include <vector>

#include "cnc/simulator/settings.hpp"
#include "cnc/simulator/store.hpp"

namespace millrace::cnc::simulator {

/// Names without the axis. Documented in examples of the manuals (V.A.ACT_POS.X, V.A.ABS.X,
/// V.A.WCS.X, V.A.+SWE.X); without offsets and compensations the first three are one position.
inline constexpr std::array<std::string_view, 5> axis_quantities{"V.A.ABS", "V.A.ACT_POS",
                                                                 "V.A.WCS", "V.A.-SWE", "V.A.+SWE"};

/// "V.A.ABS.X" and so on, all axes of one quantity in a row; `position` gives that of the axis of a
/// slot, from 0, in mm.
void add_axis_variables(Family& family, const std::vector<AxisSettings>& axes,
                        const std::function<double(std::size_t)>& position);

/// What the configuration adds, one for each axis where it says so; each channel has its own.
void add_system_variables(Store& store, const std::vector<SystemVariable>& variables,
                          const std::vector<AxisSettings>& axes);

}  // namespace millrace::cnc::simulator
