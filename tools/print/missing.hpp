// What a recording lacks of its calls, for people and for programs.
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

/// "4998 calls are complete; of 2 calls something is missing: at least 1 request, 0 replies, 2
/// events; of 3 calls nothing was received"
std::string missing_text(const recording::Missing& missing);

}  // namespace millrace::tools::print
