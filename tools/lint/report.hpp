// Findings as text, as JSON, and for editors and CI (SARIF 2.1.0). Pure.
#pragma once

#include <string>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "tools/lint/finding.hpp"

namespace millrace::tools::lint {

/// "part.nc:12:1: warning: … [wait-without-flush]", as compilers write it, with a line end.
std::string text_of(const Finding& finding);

/// [{file, line, column, severity, rule, text}]
boost::json::array json_of(const std::vector<Finding>& findings);

/// A log of one run, with all rules. `version` is this program's.
boost::json::object sarif_of(const std::vector<Finding>& findings, std::string_view version);

/// "2 errors, 1 warning"; "nothing found".
std::string summary_of(const std::vector<Finding>& findings);

/// Whether the exit code is 1: an error, or, if `strict`, a warning.
bool fails(const std::vector<Finding>& findings, bool strict);

}  // namespace millrace::tools::lint
