#include "tests/support/own_network.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>

#include <arpa/inet.h>
#include <net/if.h>
#include <net/route.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "base/posix/system.hpp"

namespace millrace::tests {

namespace {

using base::posix::last_error;

constexpr char loopback[] = "lo";

/// Works without root where the host allows user namespaces.
std::string enter_namespaces() {
  if (::unshare(CLONE_NEWNET) == 0) {
    return {};
  }
  const std::string map = "0 " + std::to_string(::geteuid()) + " 1";
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) {
    return last_error("this host has no network namespaces for tests");
  }
  std::ofstream("/proc/self/uid_map") << map;
  return {};
}

std::string enable_loopback(int socket) {
  ifreq request{};
  std::strcpy(request.ifr_name, loopback);
  request.ifr_flags = IFF_UP;
  return ::ioctl(socket, SIOCSIFFLAGS, &request) == 0 ? "" : last_error("raising lo");
}

sockaddr address_of(const char* text) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  ::inet_pton(AF_INET, text, &address.sin_addr);
  sockaddr plain{};
  std::memcpy(&plain, &address, sizeof plain);
  return plain;
}

std::string route_multicast(int socket) {
  char device[] = "lo";
  rtentry route{};
  route.rt_dst = address_of("224.0.0.0");
  route.rt_genmask = address_of("240.0.0.0");
  route.rt_flags = RTF_UP;
  route.rt_dev = device;
  return ::ioctl(socket, SIOCADDRT, &route) == 0 ? "" : last_error("a route for multicast");
}

}  // namespace

std::string enter_own_network() {
  if (const std::string obstacle = enter_namespaces(); !obstacle.empty()) {
    return obstacle;
  }
  const base::posix::Fd socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (const std::string obstacle = enable_loopback(socket.get()); !obstacle.empty()) {
    return obstacle;
  }
  return route_multicast(socket.get());
}

}  // namespace millrace::tests
