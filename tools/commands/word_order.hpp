// The order of words on the command line. Pure.
#pragma once

#include <string>
#include <vector>

namespace millrace::tools::commands {

/// Moves global options behind the command, where it takes them:
/// "--domain 7 services" is "services --domain 7". Without a command: `status`.
std::vector<std::string> word_order(std::vector<std::string> words);

}  // namespace millrace::tools::commands
