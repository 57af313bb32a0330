// What needs attention on a fabric, the worst first. Pure.
#pragma once

#include <string>
#include <vector>

#include "tools/bus/fabric_model.hpp"

namespace millrace::tools::commands::status {

// Exit codes; the lowest that applies is the exit code of the process. 1 has priority over these.
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

/// Of gateways, controllers, calls, services and programs. `flags`: for suggested commands
/// (fabric::profile::given_flags).
std::vector<Problem> problems_of(const bus::FabricModel& live, fabric::Time now,
                                 const std::string& flags = {});

/// Problems for expected machines, or hosts of gateways, without a gateway.
std::vector<Problem> missing_gateways(const bus::FabricModel& live,
                                      const std::vector<std::string>& names);
/// Service by UUID or name, and the number of instances that it must have, without draining ones.
using Expected = std::vector<std::pair<std::string, std::size_t>>;
std::vector<Problem> missing_instances(const bus::FabricModel& live, const Expected& services);

/// By severity, then by age: the worst and oldest first.
void sort(std::vector<Problem>& problems);
/// The lowest code that applies; exit_done if none.
int exit_code_of(const std::vector<Problem>& problems);

}  // namespace millrace::tools::commands::status
