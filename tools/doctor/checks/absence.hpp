// Processes that should be on the fabric and are not: where are they?
#pragma once

#include <set>
#include <string>

#include "tools/doctor/checks/report.hpp"
#include "tools/doctor/findings.hpp"

namespace millrace::tools::doctor::checks {

/// Multicast arrives, but packets to one host alone do not.
void for_half_deaf(const Findings& found, Report& report);
/// This fabric has no other process; the domain has the fabrics `others`.
void for_the_others(const Findings& found, const std::set<std::string>& others, Report& report);

}  // namespace millrace::tools::doctor::checks
