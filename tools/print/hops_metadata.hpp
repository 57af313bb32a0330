// The times of hops as a metadata record of a file, which is part of its summary.
#pragma once

#include <map>
#include <string>

#include "tools/recording/hops.hpp"

namespace millrace::tools::print {

/// "560aacbf-… work" → "calls 17, p50 79.0 us, p99 1.20 ms, max 1.20 ms".
std::map<std::string, std::string> hops_metadata(const recording::HopStatistics& hops);

}  // namespace millrace::tools::print
