// What needs attention on a fabric, the worst first. Pure.
#pragma once

#include <string>
#include <vector>

#include "tools/bus/fabric_model.hpp"

namespace millrace::tools::commands::status {

// Exit codes; the first that applies is that of the process. 1 is above all of them.
inline constexpr int exit_link_down = 3;
inline constexpr int exit_held = 4;
inline constexpr int exit_unserved = 5;
inline constexpr int exit_alarm = 6;

struct Problem {
  /// exit_done for a warning.
  int code = 0;
  /// "HELD", "LINK DOWN".
  std::string kind{};
  /// The channel, machine or program.
  std::string subject{};
  fabric::Time since{};
  std::string text{};
  /// What to do; may be empty.
  std::string advice{};
};

/// Of gateways, controllers, calls, services and programs.
std::vector<Problem> problems_of(const bus::FabricModel& live, fabric::Time now);

/// Machines whose gateway must report, or hosts of gateways.
std::vector<Problem> missing_gateways(const bus::FabricModel& live,
                                      const std::vector<std::string>& names);
/// Of each service, by UUID or name, so many instances that do not drain.
using Expected = std::vector<std::pair<std::string, std::size_t>>;
std::vector<Problem> missing_instances(const bus::FabricModel& live, const Expected& services);

/// The worst first, of equals the oldest.
void sort(std::vector<Problem>& problems);
/// Of all of them.
int exit_code_of(const std::vector<Problem>& problems);

}  // namespace millrace::tools::commands::status
