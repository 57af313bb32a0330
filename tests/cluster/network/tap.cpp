#include "tests/cluster/network/tap.hpp"

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <linux/if.h>
#include <linux/if_tun.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace millrace::tests::cluster {

namespace {

[[noreturn]] void fail(const std::string& what) {
  throw std::system_error(errno, std::generic_category(), what);
}

int open_file(const std::filesystem::path& file, int flags) {
  const int descriptor = ::open(file.c_str(), flags | O_CLOEXEC);
  if (descriptor < 0) {
    fail(file.string());
  }
  return descriptor;
}

/// Moves the calling thread to a network namespace for as long as it lives.
class InNamespace {
 public:
  explicit InNamespace(const std::filesystem::path& there)
      : home_(open_file("/proc/thread-self/ns/net", O_RDONLY)) {
    const int descriptor = open_file(there, O_RDONLY);
    const int moved = ::setns(descriptor, CLONE_NEWNET);
    ::close(descriptor);
    if (moved != 0) {
      ::close(home_);
      fail("cannot enter the network namespace " + there.string());
    }
  }
  ~InNamespace() {
    ::setns(home_, CLONE_NEWNET);
    ::close(home_);
  }
  InNamespace(const InNamespace&) = delete;
  InNamespace& operator=(const InNamespace&) = delete;

 private:
  int home_;
};

}  // namespace

Tap::Tap(const std::filesystem::path& network_namespace, const std::string& name) {
  const InNamespace there(network_namespace);
  descriptor_ = open_file("/dev/net/tun", O_RDWR | O_NONBLOCK);
  ifreq request{};
  name.copy(request.ifr_name, IFNAMSIZ - 1);
  request.ifr_flags = IFF_TAP | IFF_NO_PI;
  if (::ioctl(descriptor_, TUNSETIFF, &request) != 0) {
    ::close(descriptor_);
    fail("cannot make the TAP device " + name);
  }
}

Tap::~Tap() {
  if (descriptor_ >= 0) {
    ::close(descriptor_);
  }
}

Tap::Tap(Tap&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

std::string Tap::read() const {
  std::array<char, 2048> buffer{};  // more than an Ethernet frame
  const ssize_t length = ::read(descriptor_, buffer.data(), buffer.size());
  return length > 0 ? std::string(buffer.data(), static_cast<std::size_t>(length)) : std::string();
}

void Tap::write(const std::string& frame) const {
  [[maybe_unused]] const ssize_t written = ::write(descriptor_, frame.data(), frame.size());
}

}  // namespace millrace::tests::cluster
