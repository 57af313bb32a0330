#include "tests/support/domain.hpp"

#include <filesystem>
#include <stdexcept>
#include <string>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace millrace::tests {

namespace {

/// DDS uses the ports from 7400 + 250 * domain on; those of higher domains are in the range from
/// which Linux assigns ports, 32768 and up.
constexpr std::uint32_t last_domain = 101;

/// Returns the descriptor that holds the lock, or -1 if another test has the domain.
int try_lock(std::uint32_t domain) {
  const auto file = std::filesystem::temp_directory_path() /
                    ("millrace-test-domain-" + std::to_string(domain) + ".lock");
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor >= 0 && ::flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    ::close(descriptor);
    return -1;
  }
  return descriptor;
}

}  // namespace

Domain::Domain() {
  // Each process starts at a different domain: one that was just left may still carry a farewell.
  const auto start = static_cast<std::uint32_t>(::getpid());
  for (std::uint32_t i = 0; i < last_domain; ++i) {
    number_ = (start + i) % last_domain + 1;
    lock_ = try_lock(number_);
    if (lock_ >= 0) {
      return;
    }
  }
  throw std::runtime_error("no free DDS domain for a test: all lock files are held");
}

Domain::~Domain() {
  ::close(lock_);
}

}  // namespace millrace::tests
