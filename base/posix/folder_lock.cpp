#include "base/posix/folder_lock.hpp"

#include <cerrno>
#include <stdexcept>

#include <fcntl.h>
#include <sys/file.h>

namespace millrace::base::posix {

Fd lock_folder(const std::filesystem::path& folder, const std::string& name,
               std::string_view taken) {
  const std::filesystem::path file = folder / name;
  Fd fd(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640));
  if (!fd) {
    throw std::runtime_error(last_error("cannot open " + file.string()));
  }
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
    throw std::runtime_error(errno == EWOULDBLOCK ? folder.string() + ": " + std::string(taken)
                                                  : last_error("cannot lock " + file.string()));
  }
  return fd;
}

}  // namespace millrace::base::posix
