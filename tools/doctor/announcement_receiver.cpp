#include "tools/doctor/announcement_receiver.hpp"

#include <array>
#include <cerrno>
#include <cstring>

#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "base/messages/catalogue.hpp"
#include "fabric/profile/profile.hpp"
#include "tools/doctor/network.hpp"

namespace millrace::tools::doctor {

namespace {

using base::posix::Fd;

/// The largest UDP packet.
constexpr std::size_t largest_packet = 65536;

void set(int socket, int level, int option) {
  const int on = 1;
  ::setsockopt(socket, level, option, &on, sizeof on);
}

/// A socket that gets the group's packets of one port and one interface; none, and why, if not.
Fd listen(std::uint32_t port, unsigned interface, std::string& why) {
  Fd socket(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket) {
    why = std::strerror(errno);
    return socket;
  }
  // All processes of this host on that domain have the port open, too.
  set(socket.get(), SOL_SOCKET, SO_REUSEADDR);
  set(socket.get(), SOL_SOCKET, SO_REUSEPORT);
  const int off = 0;
  ::setsockopt(socket.get(), IPPROTO_IP, IP_MULTICAST_ALL, &off, sizeof off);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  ::inet_pton(AF_INET, discovery_group, &address.sin_addr);
  ip_mreqn group{};
  group.imr_multiaddr = address.sin_addr;
  group.imr_ifindex = static_cast<int>(interface);
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::setsockopt(socket.get(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) != 0) {
    why = std::strerror(errno);
    socket.close();
  }
  return socket;
}

}  // namespace

AnnouncementReceiver::AnnouncementReceiver(const std::string& interface) {
  const unsigned index = ::if_nametoindex(interface.c_str());
  for (std::uint32_t domain = 0; index != 0 && domain <= fabric::profile::last_domain; ++domain) {
    std::string why;
    sockets_.push_back(listen(discovery_port(domain), index, why));
    if (!why.empty() && trouble_.empty()) {
      trouble_ = base::messages::cannot_listen_to_group(discovery_group, interface, why);
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
      const ssize_t size = ::recvfrom(sockets_[domain].get(), packet.data(), packet.size(), 0,
                                      reinterpret_cast<sockaddr*>(&from), &length);
      if (size < 0) {
        break;
      }
      if (auto who = parse_announcement({packet.data(), static_cast<std::size_t>(size)})) {
        const GuidPrefix prefix = who->prefix;
        announcements_.insert_or_assign(
            prefix, ReceivedAnnouncement{std::move(*who), domain, address_text(from)});
      }
    }
  }
}

}  // namespace millrace::tools::doctor
