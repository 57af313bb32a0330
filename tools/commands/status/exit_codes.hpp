// The exit code of `millrace status`. Pure.
#pragma once

#include <vector>

#include "fabric/plant/concern.hpp"

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

}  // namespace millrace::tools::commands::status
