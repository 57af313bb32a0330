#include "tools/doctor/peer.hpp"

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>

#include <arpa/inet.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tools/doctor/network.hpp"

namespace millrace::tools::doctor {

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
    std::array<char, INET_ADDRSTRLEN> text{};
    if (::inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size()) != nullptr) {
      peer.address = text.data();
    }
    Probe probe(peer);
    probe.send(domain, address);
    constexpr std::chrono::seconds patience{1};
    probe.listen(patience);
    peers.push_back(peer);
  }
  return peers;
}

}  // namespace millrace::tools::doctor
