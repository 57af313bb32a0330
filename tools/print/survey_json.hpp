// The contents of a recording as JSON.
#pragma once

#include <cstdint>

#include <boost/json/object.hpp>

#include "tools/mcap/summary.hpp"

namespace millrace::tools::print {

/// As `recording info --json` prints it; `size` is that of the file, in bytes.
boost::json::object json_of(std::uint64_t size, const mcap::Survey& survey);

}  // namespace millrace::tools::print
