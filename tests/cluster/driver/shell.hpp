// Commands of the system that the back ends use.
#pragma once

#include <string>
#include <vector>

namespace millrace::tests::cluster {

/// Runs a command, found by PATH, and returns its standard output. Throws std::runtime_error with
/// all output if its exit code is not 0.
std::string run(const std::vector<std::string>& command);

/// True if a program is found by PATH.
bool exists(const std::string& program);

}  // namespace millrace::tests::cluster
