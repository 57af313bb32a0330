// The name of this host.
#pragma once

#include <string>

namespace millrace::base::posix {

/// As `hostname` prints it; empty if the system does not return it.
std::string host_name();

}  // namespace millrace::base::posix
