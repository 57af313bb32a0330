#include "tools/doctor/network.hpp"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <sstream>

#include <arpa/inet.h>
#include <boost/asio/ip/address_v4.hpp>
#include <ifaddrs.h>
#include <net/if.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/text/ascii.hpp"

namespace millrace::tools::doctor {

namespace {

constexpr std::uint32_t last_domain_to_guess = 100;
constexpr int hexadecimal = 16;

/// 239.255.0.1 as /proc/net/igmp writes it on a little-endian host.
constexpr std::string_view group_in_proc = "0100FFEF";

}  // namespace

std::string address_text(const sockaddr_in& address) {
  return boost::asio::ip::make_address_v4(ntohl(address.sin_addr.s_addr)).to_string();
}

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
    interface.carrier = (each->ifa_flags & IFF_RUNNING) != 0;
    interface.multicast = (each->ifa_flags & IFF_MULTICAST) != 0;
    interface.loopback = (each->ifa_flags & IFF_LOOPBACK) != 0;
    if (each->ifa_addr != nullptr && each->ifa_addr->sa_family == AF_INET &&
        interface.address.empty()) {
      interface.address = address_text(reinterpret_cast<const sockaddr_in&>(*each->ifa_addr));
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
    const auto port = colon == std::string::npos
                          ? std::nullopt
                          : base::text::parse_number<std::uint32_t>(
                                std::string_view(local).substr(colon + 1), hexadecimal);
    if (!port || *port < first_port) {
      continue;
    }
    const std::uint32_t domain = (*port - first_port) / ports_per_domain;
    const std::uint32_t offset = (*port - first_port) % ports_per_domain;
    if (domain <= last_domain_to_guess &&
        (offset <= 1 || (offset >= unicast_offset && offset < unicast_offset + 200))) {
      domains.insert(domain);
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

namespace {

using Clock = std::chrono::steady_clock;

/// Few enough that no host limits the rate of its refusals (Linux: a burst of six per second).
constexpr std::uint32_t ports_to_try = 4;

/// Connected UDP sockets: each gets the refusals of its own port.
class Probe {
 public:
  explicit Probe(Peer& peer) : peer_(peer) {}
  ~Probe() {
    for (const pollfd& each : sockets_) {
      ::close(each.fd);
    }
  }
  Probe(const Probe&) = delete;
  Probe& operator=(const Probe&) = delete;

  void send(std::uint32_t domain, sockaddr_in address) {
    for (std::uint32_t i = 0; i < ports_to_try; ++i) {
      address.sin_port =
          htons(static_cast<std::uint16_t>(discovery_port(domain) + unicast_offset + 2 * i));
      const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
      if (socket < 0) {
        return;
      }
      sockets_.push_back({socket, POLLIN, 0});
      if (::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
          ::send(socket, nullptr, 0, 0) < 0) {
        note(errno);
      }
    }
  }

  /// Until every port has refused, or for this time.
  void listen(std::chrono::milliseconds patience) {
    const auto end = Clock::now() + patience;
    while (refusals_ < sockets_.size() && !done_ && Clock::now() < end) {
      const auto rest = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
      if (::poll(sockets_.data(), sockets_.size(), static_cast<int>(rest.count())) <= 0) {
        break;
      }
      for (pollfd& each : sockets_) {
        int error = 0;
        socklen_t size = sizeof error;
        if (each.revents != 0 && ::getsockopt(each.fd, SOL_SOCKET, SO_ERROR, &error, &size) == 0 &&
            error != 0) {
          note(error);
          each.events = 0;
        }
      }
    }
    if (!done_ && !sockets_.empty() && refusals_ == sockets_.size()) {
      peer_.reach = Reach::refused;
    }
  }

 private:
  void note(int error) {
    peer_.detail = std::strerror(error);
    if (error == ECONNREFUSED) {
      ++refusals_;
    } else {
      peer_.reach = Reach::unreachable;
      done_ = true;
    }
  }

  Peer& peer_;
  std::vector<pollfd> sockets_;
  std::size_t refusals_ = 0;
  bool done_ = false;
};

}  // namespace

std::vector<Peer> probe_peers(const std::vector<std::string>& names, std::uint32_t domain) {
  std::vector<Peer> peers;
  for (const std::string& name : names) {
    Peer peer{.name = name};
    addrinfo wanted{};
    wanted.ai_family = AF_INET;
    wanted.ai_socktype = SOCK_DGRAM;
    addrinfo* found = nullptr;
    if (const int error = ::getaddrinfo(name.c_str(), nullptr, &wanted, &found); error != 0) {
      peer.reach = Reach::unknown_name;
      peer.detail = ::gai_strerror(error);
      peers.push_back(std::move(peer));
      continue;
    }
    sockaddr_in address{};
    std::memcpy(&address, found->ai_addr, sizeof address);
    ::freeaddrinfo(found);
    peer.address = address_text(address);
    Probe probe(peer);
    probe.send(domain, address);
    constexpr std::chrono::seconds patience{1};
    probe.listen(patience);
    peers.push_back(peer);
  }
  return peers;
}

}  // namespace millrace::tools::doctor
