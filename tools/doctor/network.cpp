#include "tools/doctor/network.hpp"

#include <array>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <sstream>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

namespace millrace::tools::doctor {

namespace {

constexpr std::uint32_t last_domain_to_guess = 100;
constexpr int hexadecimal = 16;

/// 239.255.0.1 as /proc/net/igmp writes it on a little-endian host.
constexpr std::string_view group_in_proc = "0100FFEF";

std::string address_of(const sockaddr& address) {
  std::array<char, INET_ADDRSTRLEN> text{};
  const auto& ipv4 = reinterpret_cast<const sockaddr_in&>(address);
  return ::inet_ntop(AF_INET, &ipv4.sin_addr, text.data(), text.size()) != nullptr ? text.data()
                                                                                   : "";
}

}  // namespace

std::vector<Interface> interfaces_here() {
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0) {
    return {};
  }
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(first, &::freeifaddrs);
  std::map<std::string, Interface> by_name;
  for (const ifaddrs* each = first; each != nullptr; each = each->ifa_next) {
    Interface& interface = by_name[each->ifa_name];
    interface.name = each->ifa_name;
    interface.up = (each->ifa_flags & IFF_UP) != 0;
    interface.multicast = (each->ifa_flags & IFF_MULTICAST) != 0;
    interface.loopback = (each->ifa_flags & IFF_LOOPBACK) != 0;
    if (each->ifa_addr != nullptr && each->ifa_addr->sa_family == AF_INET &&
        interface.address.empty()) {
      interface.address = address_of(*each->ifa_addr);
    }
  }
  std::vector<Interface> all;
  all.reserve(by_name.size());
  for (auto& [name, interface] : by_name) {
    all.push_back(std::move(interface));
  }
  return all;
}

std::set<std::uint32_t> domains_in(std::string_view proc_net_udp) {
  std::set<std::uint32_t> domains;
  std::istringstream lines{std::string(proc_net_udp)};
  std::string number;
  std::string local;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream(line) >> number >> local;
    const auto colon = local.find(':');
    if (colon == std::string::npos ||
        local.find_first_not_of("0123456789ABCDEF", colon + 1) != std::string::npos ||
        colon + 1 == local.size()) {
      continue;
    }
    const auto port =
        static_cast<std::uint32_t>(std::stoul(local.substr(colon + 1), nullptr, hexadecimal));
    const std::uint32_t domain = (port - first_port) / ports_per_domain;
    if (port >= first_port && domain <= last_domain_to_guess) {
      const std::uint32_t offset = (port - first_port) % ports_per_domain;
      if (offset <= 1 || (offset >= unicast_offset && offset < unicast_offset + 200)) {
        domains.insert(domain);
      }
    }
  }
  return domains;
}

std::set<std::string> listening_interfaces_in(std::string_view proc_net_igmp) {
  std::set<std::string> interfaces;
  std::istringstream lines{std::string(proc_net_igmp)};
  std::string interface;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string first;
    std::string second;
    words >> first >> second;
    // A line that begins at its margin names an interface, the others its groups.
    if (!line.empty() && line.front() != '\t' && line.front() != ' ') {
      interface = second.substr(0, second.find(':'));
    } else if (first == group_in_proc) {
      interfaces.insert(interface);
    }
  }
  return interfaces;
}

std::string read_text(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace millrace::tools::doctor
