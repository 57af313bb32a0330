#include "services/sdk/file_changes.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

namespace millrace::services::sdk {

std::string fingerprint(const std::vector<std::filesystem::path>& files) {
  std::string print;
  for (const std::filesystem::path& file : files) {
    struct stat status {};
    print += ::stat(file.c_str(), &status) != 0
                 ? "-\n"
                 : fmt::format("{}.{} {} {:o} {}\n", status.st_mtim.tv_sec, status.st_mtim.tv_nsec,
                               status.st_size, status.st_mode, status.st_ino);
  }
  return print;
}

bool Settle::look(const std::string& state, Time now) {
  if (state != seen_) {
    seen_ = state;
    since_ = now;
  }
  if (seen_ == taken_ || now - since_ < quiet_) {
    return false;
  }
  taken_ = seen_;
  return true;
}

}  // namespace millrace::services::sdk
