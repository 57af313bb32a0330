// The writer's name in our files.
#pragma once

#include <string>

namespace millrace::tools::commands {

/// "millrace 0.1.0".
std::string library_name();

}  // namespace millrace::tools::commands
