#include "services/lcm/socket.hpp"

#include <memory>
#include <stdexcept>

#include <arpa/inet.h>
#include <boost/asio/ip/multicast.hpp>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <linux/filter.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "base/program/barrier.hpp"
#include "fabric/lcm/packet.hpp"

namespace millrace::services::lcm {

namespace asio = boost::asio;
using asio::ip::udp;

namespace {

/// Datagrams that are read before other work of the loop.
constexpr int most_per_turn = 64;
/// Buffers datagrams while the loop does other work; the kernel may grant less.
constexpr int receive_buffer = 4 << 20;

/// The group returns this process's own datagrams, which would wake it needlessly: the kernel drops
/// them for `in`.
void drop_what_comes_from(const udp::endpoint& own, udp::socket& in, std::uint32_t longest) {
  constexpr auto source_address = static_cast<std::uint32_t>(SKF_NET_OFF + 12);
  constexpr std::uint32_t source_port =
      0;  // offset in the UDP header, at which a socket filter begins
  constexpr std::uint16_t load_word = BPF_LD | BPF_W | BPF_ABS;
  constexpr std::uint16_t load_half = BPF_LD | BPF_H | BPF_ABS;
  constexpr std::uint16_t jump_if_equal = BPF_JMP | BPF_JEQ | BPF_K;
  constexpr std::uint16_t keep = BPF_RET | BPF_K;
  std::array<sock_filter, 6> program{{{load_half, 0, 0, source_port},
                                      {jump_if_equal, 0, 3, own.port()},
                                      {load_word, 0, 0, source_address},
                                      {jump_if_equal, 0, 1, own.address().to_v4().to_uint()},
                                      {keep, 0, 0, 0},
                                      {keep, 0, 0, longest}}};
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  // If that is not permitted, they are ignored later.
  static_cast<void>(
      ::setsockopt(in.native_handle(), SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter));
}

constexpr std::uint32_t loopback_network = 127;

std::set<std::uint32_t> look() {
  std::set<std::uint32_t> addresses;
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0) {
    return addresses;
  }
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(first, &::freeifaddrs);
  for (const ifaddrs* interface = first; interface != nullptr; interface = interface->ifa_next) {
    if (interface->ifa_addr != nullptr && interface->ifa_addr->sa_family == AF_INET) {
      const auto* address = reinterpret_cast<const sockaddr_in*>(interface->ifa_addr);
      addresses.insert(ntohl(address->sin_addr.s_addr));
    }
  }
  return addresses;
}

}  // namespace

Socket::Socket(asio::io_context& loop, const Network& network, SocketListener& listener)
    : network_(network),
      listener_(listener),
      group_(asio::ip::make_address_v4(network.group), network.port),
      in_(loop),
      out_(loop) {
  try {
    open();
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error(
        fmt::format("cannot join LCM's group {} on the interface {}: {}; check url and interface "
                    "in the configuration, and whether the interface is up",
                    network.url, network.interface, error.code().message()));
  }
}

void Socket::open() {
  const auto interface = asio::ip::make_address_v4(network_.interface);
  in_.open(udp::v4());
  // As the LCM processes do: all of them on a host receive the group.
  in_.set_option(udp::socket::reuse_address(true));
  in_.set_option(asio::socket_base::receive_buffer_size(receive_buffer));
  // Bound to the group's address, so that datagrams to this host's own address are not received.
  in_.bind(group_);
  in_.set_option(asio::ip::multicast::join_group(group_.address().to_v4(), interface));
  in_.non_blocking(true);
  out_.open(udp::v4());
  out_.set_option(asio::ip::multicast::outbound_interface(interface));
  out_.set_option(asio::ip::multicast::hops(network_.ttl));
  out_.set_option(asio::ip::multicast::enable_loopback(true));
  out_.bind({interface, 0});
  out_.non_blocking(true);
  drop_what_comes_from(out_.local_endpoint(), in_, longest_datagram);
  wait();
}

void Socket::wait() {
  in_.async_wait(udp::socket::wait_read, [this](const boost::system::error_code& error) {
    if (!error) {
      base::program::contain("receiving LCM messages", [this] { read(); });
      wait();
    }
  });
}

void Socket::read() {
  for (int i = 0; i < most_per_turn; ++i) {
    boost::system::error_code error;
    udp::endpoint from;
    const std::size_t size = in_.receive_from(asio::buffer(buffer_), from, 0, error);
    if (error) {
      return;
    }
    take({buffer_.data(), size}, from);
  }
}

void Socket::take(std::string_view datagram, const udp::endpoint& from) {
  const Sender sender{from.address().to_v4().to_uint(), from.port()};
  if (network_.ttl == 0 && !is_local(sender.address, std::chrono::steady_clock::now())) {
    listener_.on_foreign(sender);
    return;
  }
  if (const auto packet = fabric::lcm::parse_packet(datagram)) {
    listener_.on_packet(packet->channel, packet->message, sender);
  } else if (packet.error() == fabric::lcm::PacketFault::fragment) {
    if (const auto channel = fabric::lcm::channel_of_fragment(datagram)) {
      listener_.on_fragment(*channel, sender);
    }
  }
}

tl::expected<void, std::string> Socket::publish(std::string_view channel, std::string_view bytes) {
  const std::string datagram =
      fabric::lcm::format_packet({.number = number_++, .channel = channel, .message = bytes});
  boost::system::error_code error;
  out_.send_to(asio::buffer(datagram), group_, 0, error);
  if (error) {
    return tl::unexpected(
        fmt::format("{} bytes on {} are lost: {}", bytes.size(), channel, error.message()));
  }
  return {};
}

bool Socket::is_local(std::uint32_t address, std::chrono::steady_clock::time_point now) {
  // A datagram over the loopback interface without an address comes from 0.0.0.0. The kernel
  // accepts neither address from a network.
  if (address == INADDR_ANY || address >> 24U == loopback_network) {
    return true;
  }
  if (addresses_.contains(address)) {
    return true;
  }
  if (now - looked_ < std::chrono::seconds(1)) {
    return false;
  }
  looked_ = now;
  addresses_ = look();
  return addresses_.contains(address);
}

}  // namespace millrace::services::lcm
