// Texts for findings.
#pragma once

#include <set>
#include <string>

#include "tools/doctor/announcement.hpp"

namespace millrace::tools::doctor::checks {

/// "a, b, c", fit for a terminal.
std::string list_of(const std::set<std::string>& names);
/// "name on host, pid 17", as far as it is known.
std::string program_text(const Announcement& who);

}  // namespace millrace::tools::doctor::checks
