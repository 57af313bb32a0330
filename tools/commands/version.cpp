#include "tools/commands/version.hpp"

namespace millrace::tools::commands {

std::string library_name() {
  return "millrace " MILLRACE_VERSION;
}

}  // namespace millrace::tools::commands
