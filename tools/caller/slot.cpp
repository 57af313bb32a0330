#include "tools/caller/slot.hpp"

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <functional>
#include <random>

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <time.h>

namespace millrace::tools::caller {

namespace {

using base::posix::Fd;

/// An abstract socket: Linux frees its name with its last descriptor, however the process ends.
Fd lock(const std::string& name) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (name.size() >= sizeof address.sun_path) {
    return Fd();
  }
  std::ranges::copy(name, address.sun_path + 1);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  Fd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const bool is_locked =
      fd && ::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), size) == 0;
  return is_locked ? std::move(fd) : Fd();
}

/// Differs between hosts, between two starts of one host, and between network namespaces, since
/// each has names of sockets of its own. Virtual machines that continue from one snapshot differ by
/// their host names only.
std::string this_host() {
  std::string boot;
  std::getline(std::ifstream("/proc/sys/kernel/random/boot_id"), boot);
  struct stat network {};
  if (boot.empty() || ::stat("/proc/self/ns/net", &network) != 0) {
    return {};
  }
  return fmt::format("{} {} {}", base::posix::host_name(), boot, network.st_ino);
}

/// Grows as long as the host runs, also when its clock is set. No caller makes a million calls a
/// second.
std::uint64_t microseconds_since_boot() {
  timespec time{};
  ::clock_gettime(CLOCK_BOOTTIME, &time);
  return static_cast<std::uint64_t>(time.tv_sec) * 1'000'000 +
         static_cast<std::uint64_t>(time.tv_nsec) / 1'000;
}

std::uint64_t random_epoch() {
  std::random_device source;
  return std::uint64_t{source()} << 32U | source();
}

}  // namespace

Slot::Slot(std::string_view prefix, const fabric::dds::ParticipantOptions& options) {
  const std::string host = this_host();
  for (int number = 0; number < most && !lock_ && !host.empty(); ++number) {
    const std::string name =
        fmt::format("millrace-caller {} {} {}", options.domain, number, options.fabric);
    lock_ = lock(name);
    before_first_ = {std::hash<std::string>()(host + name), microseconds_since_boot()};
  }
  if (!lock_) {
    before_first_ = {random_epoch(), 0};
  }
  // 0 means "no call".
  before_first_.epoch |= 1U;
  machine_ = fmt::format("{}.{:08x}", prefix, before_first_.epoch >> 32U);
}

}  // namespace millrace::tools::caller
