#include "base/posix/host.hpp"

#include <array>

#include <unistd.h>

namespace millrace::base::posix {

std::string host_name() {
  // A truncated name may have no NUL: the last byte stays zero.
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

}  // namespace millrace::base::posix
