#include "tests/cluster/driver/resources.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace millrace::tests::cluster {

Resources resources_of(pid_t process) {
  const std::filesystem::path proc = "/proc/" + std::to_string(process);
  std::ifstream status(proc / "status");
  if (!status) {
    throw std::runtime_error("there is no process " + std::to_string(process));
  }
  Resources found;
  std::string name;
  while (status >> name) {
    if (name == "VmRSS:") {
      constexpr std::size_t kibibyte = 1024;
      status >> found.bytes;
      found.bytes *= kibibyte;
    } else if (name == "Threads:") {
      status >> found.threads;
    }
  }
  const std::filesystem::directory_iterator descriptors(proc / "fd");
  found.descriptors = static_cast<std::size_t>(std::distance(begin(descriptors), end(descriptors)));
  return found;
}

}  // namespace millrace::tests::cluster
