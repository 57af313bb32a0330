// Programs that should be here and are not: where are they?
#pragma once

#include <set>
#include <string>

#include "tools/doctor/checks/report.hpp"
#include "tools/doctor/findings.hpp"

namespace millrace::tools::doctor::checks {

/// Multicast comes through, but what is sent to one of us alone does not.
void for_half_deaf(const Findings& found, Report& report);
/// This fabric has no other process; the domain has the fabrics `others`.
void for_the_others(const Findings& found, const std::set<std::string>& others, Report& report);

}  // namespace millrace::tools::doctor::checks
