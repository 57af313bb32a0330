// The missing samples of a recording's calls, as text and JSON.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "tools/recording/completeness.hpp"

namespace millrace::tools::print {

/// Each count and its name in metadata and JSON: "calls_complete", …, "missing_events".
std::array<std::pair<std::string_view, std::uint64_t>, 6> missing_counts(
    const recording::Missing& missing);

/// "4998 calls are complete; 2 calls are incomplete: at least 1 request, 0 replies and 2 events are
/// missing; 3 calls were not received"
std::string missing_text(const recording::Missing& missing);

}  // namespace millrace::tools::print
