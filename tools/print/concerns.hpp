// Concerns in JSON, the same in `millrace status --json`, `millrace doctor --json` and for the
// page.
#pragma once

#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "fabric/plant/concern.hpp"

namespace millrace::tools::print {

/// {kind, level, who, subject, machines, channels, uuid, since, what, why, todo, cause};
/// what is empty is left out.
boost::json::object json_of(const fabric::plant::Concern& concern);
boost::json::array json_of(const std::vector<fabric::plant::Concern>& concerns);
/// Steps: each {text}, with text_code and text_arguments.
boost::json::array json_of(const std::vector<fabric::Message>& steps);

}  // namespace millrace::tools::print
