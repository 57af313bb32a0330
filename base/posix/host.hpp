// What this host calls itself.
#pragma once

#include <string>

namespace millrace::base::posix {

/// As `hostname` prints it; empty if the system does not say.
std::string host_name();

}  // namespace millrace::base::posix
