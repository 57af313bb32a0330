// One call over every hop, as JSON.
#pragma once

#include <boost/json/object.hpp>

#include "tools/recording/timeline.hpp"

namespace millrace::tools::print {

/// As `recording calls --json FILE CALL` prints it.
boost::json::object json_of(const recording::Timeline& timeline);

}  // namespace millrace::tools::print
