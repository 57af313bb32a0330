// Values for lines of a log and for recordings, and errors for answers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cnc/ads/error.hpp"
#include "fabric/data.hpp"

namespace millrace::gateway::variables {

/// "3.5", "\"text\"", "[1, 2, 3]"; what is no printable ASCII becomes '?'.
std::string text_of(const fabric::Elements& elements);
/// The same of what somebody wrote.
std::string text_of(const std::vector<std::string>& values);

/// The number of an error as a controller tells it; 0 for our own (no answer, no link).
std::uint32_t ads_number(cnc::ads::ErrorCode code);

}  // namespace millrace::gateway::variables
