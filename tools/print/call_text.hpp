// A call in one line, over every hop, and as JSON.
#pragma once

#include <string>

#include <boost/json/object.hpp>

#include "tools/recording/timeline.hpp"

namespace millrace::tools::print {

/// Of a call that has ended. "07:00:00.123456  cnc/1  560aacbf-…  "2" 1 -> "1.414214" 1  2.40 ms
/// sq1 on vm  5f-17"
std::string line_of(const recording::Call& call, const recording::InstanceNames::Name& instance);
boost::json::object json_of(const recording::Call& call,
                            const recording::InstanceNames::Name& instance);
/// "written" or "withdrawn"; empty while it is under way.
std::string_view end_of(const recording::Call& call);
/// A line for each step, for a terminal.
std::string text_of(const recording::Timeline& timeline);

}  // namespace millrace::tools::print
