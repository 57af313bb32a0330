#include "base/posix/system.hpp"

#include <array>
#include <cerrno>
#include <system_error>

#include <unistd.h>

namespace millrace::base::posix {

Fd::~Fd() {
  close();
}

Fd& Fd::operator=(Fd&& other) noexcept {
  if (this != &other) {
    close();
    fd_ = std::exchange(other.fd_, -1);
  }
  return *this;
}

void Fd::close() {
  if (fd_ >= 0) {
    ::close(std::exchange(fd_, -1));
  }
}

std::string last_error(std::string_view what) {
  return std::string(what) + ": " + std::generic_category().message(errno);
}

std::string host_name() {
  // A truncated name may have no NUL: the last byte stays zero.
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

}  // namespace millrace::base::posix
