// Values as text for logs and recordings, and errors for replies.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cnc/ads/error.hpp"
#include "fabric/data.hpp"

namespace millrace::gateway::variables {

/// "3.5", "\"text\"", "[1, 2, 3]"; what is not printable ASCII becomes '?'.
std::string text_of(const fabric::Elements& elements);
/// The same for values in a request.
std::string text_of(const std::vector<std::string>& values);

/// The ADS error number from a controller; 0 for our own errors (no response, no link).
std::uint32_t ads_number(cnc::ads::ErrorCode code);

}  // namespace millrace::gateway::variables
