#include "tests/cluster/driver/shell.hpp"

#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>
#include <unistd.h>

#include "tests/support/process.hpp"

namespace millrace::tests::cluster {

std::string run(const std::vector<std::string>& command) {
  std::vector<std::string> arguments{"/usr/bin/env"};
  arguments.insert(arguments.end(), command.begin(), command.end());
  Process process(arguments);
  if (const int code = process.wait(); code != 0) {
    throw std::runtime_error(fmt::format("{} ended with {}: {}{}", fmt::join(command, " "), code,
                                         process.output(), process.error_output()));
  }
  return process.output();
}

bool exists(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (::access((std::filesystem::path(folder) / program).c_str(), X_OK) == 0) {
      return true;
    }
  }
  return false;
}

}  // namespace millrace::tests::cluster
