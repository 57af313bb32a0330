// The entries of one answered call, as a recorder sees them.
#pragma once

#include <vector>

#include "tools/recording/entry.hpp"

namespace millrace::tools::recording::tests {

inline const std::string square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

/// `milliseconds` after 2026-03-01T07:00:00Z.
fabric::Time at(double milliseconds);

/// Call 5f-`number` of cnc/1 to square_root, text "2", answered "1.414214" by one instance: seen at
/// `start` ms, dispatched 1 ms later, received +0.5, started +0.1, answered +3, replied +0.5,
/// written +2. The service's clock is `service_ahead` ms ahead of the gateway's.
std::vector<Entry> one_call(std::uint64_t number, double start, double service_ahead = 0);

}  // namespace millrace::tools::recording::tests
