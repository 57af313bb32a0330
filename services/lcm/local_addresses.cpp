#include "services/lcm/local_addresses.hpp"

#include <memory>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>

namespace millrace::services::lcm {

namespace {

constexpr std::uint32_t loopback_network = 127;

std::set<std::uint32_t> look() {
  std::set<std::uint32_t> addresses;
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0) {
    return addresses;
  }
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(first, &::freeifaddrs);
  for (const ifaddrs* one = first; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr != nullptr && one->ifa_addr->sa_family == AF_INET) {
      const auto* address = reinterpret_cast<const sockaddr_in*>(one->ifa_addr);
      addresses.insert(ntohl(address->sin_addr.s_addr));
    }
  }
  return addresses;
}

}  // namespace

bool LocalAddresses::has(std::uint32_t address, std::chrono::steady_clock::time_point now) {
  // A datagram over the loopback interface without an address comes from 0.0.0.0. The kernel
  // accepts neither address from a network.
  if (address == INADDR_ANY || address >> 24U == loopback_network) {
    return true;
  }
  if (known_.contains(address)) {
    return true;
  }
  if (now - looked_ < std::chrono::seconds(1)) {
    return false;
  }
  looked_ = now;
  known_ = look();
  return known_.contains(address);
}

}  // namespace millrace::services::lcm
