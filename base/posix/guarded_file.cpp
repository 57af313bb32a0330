#include "base/posix/guarded_file.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include <sys/stat.h>

namespace millrace::base::posix {

namespace {

std::optional<FileFault> fault_of_writers(const std::filesystem::path& path, mode_t mode,
                                          mode_t forbidden) {
  if ((mode & forbidden) == 0) {
    return {};
  }
  return FileFault{
      (mode & S_IWOTH) != 0 ? "all users of this host can write it" : "its group can write it",
      "`chmod go-w " + path.string() + "`, and replace it if others may have changed it"};
}

std::optional<FileFault> fault_of(const std::filesystem::path& file, Secrecy secrecy) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) {
    return {};  // reading it reports the reason
  }
  if (!S_ISREG(status.st_mode)) {
    return FileFault{"is not a regular file", "name a file"};
  }
  if (secrecy == Secrecy::secret && (status.st_mode & S_IROTH) != 0) {
    return FileFault{
        "is a secret, and all users of this host can read it",
        "`chmod o= " + file.string() + "`, and make a new one if others may have seen it"};
  }
  return fault_of_writers(file, status.st_mode,
                          secrecy == Secrecy::secret ? S_IWGRP | S_IWOTH : S_IWOTH);
}

}  // namespace

tl::expected<std::string, FileFault> read_guarded(const std::filesystem::path& file,
                                                  Secrecy secrecy) {
  if (auto fault = fault_of(file, secrecy)) {
    return tl::unexpected(*std::move(fault));
  }
  std::ifstream in(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!in.is_open() || in.bad()) {
    const int reason = errno;
    return tl::unexpected(
        FileFault{std::string("cannot be read (") + std::strerror(reason) + ")",
                  reason == EACCES
                      ? "it and its folder have to be readable for the user of this program: see "
                        "`chown` and `chmod`"
                      : ""});
  }
  return text;
}

std::optional<FileFault> fault_of_folder(const std::filesystem::path& folder) {
  struct stat status {};
  if (::stat(folder.c_str(), &status) != 0 || (status.st_mode & S_ISVTX) != 0) {
    return {};
  }
  return fault_of_writers(folder, status.st_mode, S_IWOTH);
}

}  // namespace millrace::base::posix
