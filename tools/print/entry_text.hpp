// Entries of a recording, or of the live fabric, for people and programs.
#pragma once

#include <string>

#include <boost/json/object.hpp>

#include "tools/recording/entry.hpp"

namespace millrace::tools::print {

/// One line without newline: time, kind, channel, call, and what the kind tells.
std::string line_of(const recording::Entry& entry);

/// Every field by name. Texts are UTF-8, ids in their text form, times ISO 8601 in UTC; times that
/// are not known are left out.
boost::json::object json_of(const recording::Entry& entry);

}  // namespace millrace::tools::print
