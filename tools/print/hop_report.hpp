// The times of hops per service, as a table and as JSON.
#pragma once

#include <string>

#include <boost/json/array.hpp>

#include "tools/recording/hops.hpp"

namespace millrace::tools::print {

std::string hops_text(const recording::HopStatistics& hops);
boost::json::array hops_json(const recording::HopStatistics& hops);

}  // namespace millrace::tools::print
