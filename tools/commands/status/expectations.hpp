// What the caller of `millrace status` expects of a fabric, and the exit code of its concerns.
// Pure.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "fabric/plant/concern.hpp"
#include "fabric/plant/plant.hpp"

namespace millrace::tools::commands::status {

using Concerns = std::vector<fabric::plant::Concern>;

// Exit codes; the lowest that applies is the exit code of the process. 1 has priority over these.
inline constexpr int exit_link_down = 3;
inline constexpr int exit_held = 4;
inline constexpr int exit_unserved = 5;
inline constexpr int exit_alarm = 6;
inline constexpr int exit_program_aborted = 7;

/// exit_done for what is only to be known.
int exit_code_of(const fabric::plant::Concern& concern);
/// The lowest code that applies; exit_done if none.
int exit_code_of(const Concerns& concerns);

/// Concerns for expected machines, or hosts of gateways, without a gateway.
Concerns missing_gateways(const fabric::plant::Plant& plant, const std::vector<std::string>& names);
/// Service by UUID or name, and the number of instances that it must have, without draining ones.
using Expected = std::vector<std::pair<std::string, std::size_t>>;
Concerns missing_instances(const fabric::plant::Plant& plant, const Expected& services);

}  // namespace millrace::tools::commands::status
