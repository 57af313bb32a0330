#include "services/lcm/socket.hpp"

#include <array>
#include <atomic>
#include <memory>
#include <stdexcept>

#include <arpa/inet.h>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/multicast.hpp>
#include <boost/asio/ip/udp.hpp>
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
constexpr std::size_t longest_datagram = 65'536;

/// The group returns this process's own datagrams, which would wake it needlessly: the kernel drops
/// them for `in`.
void drop_what_comes_from(const udp::endpoint& own, udp::socket& in) {
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
                                      {keep, 0, 0, longest_datagram}}};
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  // If that is not permitted, they are ignored later.
  static_cast<void>(
      ::setsockopt(in.native_handle(), SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter));
}

}  // namespace

struct Socket::Impl {
  Impl(asio::io_context& loop, const Network& own_network, SocketListener& own_listener)
      : network(own_network),
        listener(own_listener),
        group(asio::ip::make_address_v4(network.group), network.port),
        in(loop),
        out(loop) {}

  void open();
  void wait();
  void read();
  void take(std::string_view datagram, const udp::endpoint& from);

  const Network network;
  SocketListener& listener;
  const udp::endpoint group;
  udp::socket in;
  udp::socket out;
  LocalAddresses local;
  std::atomic<std::uint32_t> number = 0;
  std::array<char, longest_datagram> buffer{};
};

void Socket::Impl::open() {
  const auto interface = asio::ip::make_address_v4(network.interface);
  in.open(udp::v4());
  // As the LCM processes do: all of them on a host receive the group.
  in.set_option(udp::socket::reuse_address(true));
  in.set_option(asio::socket_base::receive_buffer_size(receive_buffer));
  // Bound to the group's address, so that datagrams to this host's own address are not received.
  in.bind(group);
  in.set_option(asio::ip::multicast::join_group(group.address().to_v4(), interface));
  in.non_blocking(true);
  out.open(udp::v4());
  out.set_option(asio::ip::multicast::outbound_interface(interface));
  out.set_option(asio::ip::multicast::hops(network.ttl));
  out.set_option(asio::ip::multicast::enable_loopback(true));
  out.bind({interface, 0});
  out.non_blocking(true);
  drop_what_comes_from(out.local_endpoint(), in);
  wait();
}

void Socket::Impl::wait() {
  in.async_wait(udp::socket::wait_read, [this](const boost::system::error_code& error) {
    if (!error) {
      base::program::contain("receiving LCM messages", [this] { read(); });
      wait();
    }
  });
}

void Socket::Impl::read() {
  for (int i = 0; i < most_per_turn; ++i) {
    boost::system::error_code error;
    udp::endpoint from;
    const std::size_t size = in.receive_from(asio::buffer(buffer), from, 0, error);
    if (error) {
      return;
    }
    take({buffer.data(), size}, from);
  }
}

void Socket::Impl::take(std::string_view datagram, const udp::endpoint& from) {
  const Sender sender{from.address().to_v4().to_uint(), from.port()};
  if (network.ttl == 0 && !local.has(sender.address, std::chrono::steady_clock::now())) {
    listener.on_foreign(sender);
    return;
  }
  if (const auto packet = fabric::lcm::parse_packet(datagram)) {
    listener.on_packet(packet->channel, packet->message, sender);
  } else if (packet.error() == fabric::lcm::PacketFault::fragment) {
    if (const auto channel = fabric::lcm::channel_of_fragment(datagram)) {
      listener.on_fragment(*channel, sender);
    }
  }
}

Socket::Socket(asio::io_context& loop, const Network& network, SocketListener& listener)
    : impl_(std::make_unique<Impl>(loop, network, listener)) {
  try {
    impl_->open();
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error(
        fmt::format("cannot join LCM's group {} on the interface {}: {}; check url and interface "
                    "in the configuration, and whether the interface is up",
                    network.url, network.interface, error.code().message()));
  }
}

Socket::~Socket() = default;

tl::expected<void, std::string> Socket::publish(std::string_view channel, std::string_view bytes) {
  const std::string datagram =
      fabric::lcm::format_packet({.number = impl_->number++, .channel = channel, .message = bytes});
  boost::system::error_code error;
  impl_->out.send_to(asio::buffer(datagram), impl_->group, 0, error);
  if (error) {
    return tl::unexpected(
        fmt::format("{} bytes on {} are lost: {}", bytes.size(), channel, error.message()));
  }
  return {};
}

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
