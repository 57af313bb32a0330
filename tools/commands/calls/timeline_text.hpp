// One call over every hop, for a terminal.
#pragma once

#include <string>

#include "tools/recording/timeline.hpp"

namespace millrace::tools::commands::calls {

/// A line for each step.
std::string text_of(const recording::Timeline& timeline);

}  // namespace millrace::tools::commands::calls
