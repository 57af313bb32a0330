#include "tools/doctor/announcement_receiver.hpp"

#include <array>
#include <cerrno>
#include <cstring>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "fabric/profile/profile.hpp"
#include "tools/doctor/network.hpp"

namespace millrace::tools::doctor {

namespace {

/// The largest UDP packet.
constexpr std::size_t largest_packet = 65536;

void set(int socket, int level, int option) {
  const int on = 1;
  ::setsockopt(socket, level, option, &on, sizeof on);
}

/// A socket that gets the group's packets of one port and one interface; -1 and errno if not.
int listen(std::uint32_t port, unsigned interface) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket < 0) {
    return -1;
  }
  // All processes of this host on that domain have the port open, too.
  set(socket, SOL_SOCKET, SO_REUSEADDR);
  set(socket, SOL_SOCKET, SO_REUSEPORT);
  const int off = 0;
  ::setsockopt(socket, IPPROTO_IP, IP_MULTICAST_ALL, &off, sizeof off);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  ::inet_pton(AF_INET, discovery_group, &address.sin_addr);
  ip_mreqn group{};
  group.imr_multiaddr = address.sin_addr;
  group.imr_ifindex = static_cast<int>(interface);
  if (::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::setsockopt(socket, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) != 0) {
    const int reason = errno;
    ::close(socket);
    errno = reason;
    return -1;
  }
  return socket;
}

}  // namespace

AnnouncementReceiver::AnnouncementReceiver(const std::string& interface) {
  const unsigned index = ::if_nametoindex(interface.c_str());
  for (std::uint32_t domain = 0; index != 0 && domain <= fabric::profile::last_domain; ++domain) {
    const int socket = listen(discovery_port(domain), index);
    if (socket < 0 && trouble_.empty()) {
      trouble_ = fmt::format("cannot listen to group {} on {}: {}", discovery_group, interface,
                             std::strerror(errno));
    }
    sockets_.push_back(socket);
  }
}

AnnouncementReceiver::~AnnouncementReceiver() {
  for (const int socket : sockets_) {
    if (socket >= 0) {
      ::close(socket);
    }
  }
}

void AnnouncementReceiver::take() {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init)
  std::array<std::uint8_t, largest_packet> packet;
  for (std::uint32_t domain = 0; domain < sockets_.size(); ++domain) {
    for (;;) {
      sockaddr_in from{};
      socklen_t length = sizeof from;
      const ssize_t size = sockets_[domain] < 0
                               ? -1
                               : ::recvfrom(sockets_[domain], packet.data(), packet.size(), 0,
                                            reinterpret_cast<sockaddr*>(&from), &length);
      if (size < 0) {
        break;
      }
      if (auto who = parse_announcement({packet.data(), static_cast<std::size_t>(size)})) {
        const GuidPrefix prefix = who->prefix;
        heard_.insert_or_assign(prefix,
                                ReceivedAnnouncement{std::move(*who), domain, address_text(from)});
      }
    }
  }
}

}  // namespace millrace::tools::doctor
