// The limit of this machine: datagrams between two processes without any library, and within one
// thread.
#include <vector>

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>

#include "tests/bench/gateway/peers.hpp"
#include "tests/bench/process_use.hpp"

namespace millrace::bench {

namespace {

using boost::asio::buffer;
using boost::asio::ip::udp;

udp::endpoint loopback(std::uint16_t port) {
  return {boost::asio::ip::address_v4::loopback(), port};
}

constexpr std::size_t largest = 1024;

}  // namespace

void serve_udp(const PeerOptions&) {
  boost::asio::io_context io;
  udp::socket socket(io, loopback(0));
  peer_is_ready(std::to_string(socket.local_endpoint().port()));
  std::vector<char> message(largest);
  while (true) {
    udp::endpoint from;
    const std::size_t size = socket.receive_from(buffer(message), from);
    socket.send_to(buffer(message, size), from);
  }
}

Datagrams measure_datagrams(std::size_t count, std::size_t size) {
  PeerOptions options;
  options.kind = "udp";
  tests::Process peer = launch_peer(options);
  const auto port = static_cast<std::uint16_t>(std::stoul(peer.await("^ready (\\d+)").at(1)));
  boost::asio::io_context io;
  udp::socket socket(io, loopback(0));
  std::vector<char> message(size);
  const auto exchange = [&](const udp::endpoint& to) {
    socket.send_to(buffer(message), to);
    socket.receive(buffer(message));
  };
  Datagrams result;
  for (std::size_t i = 0; i < count; ++i) {
    const auto start = Clock::now();
    exchange(loopback(port));
    result.round_trips.add(Clock::now() - start);
  }
  const double before = own_processor_microseconds();
  for (std::size_t i = 0; i < count; ++i) {
    exchange(socket.local_endpoint());
  }
  result.microseconds = (own_processor_microseconds() - before) / static_cast<double>(count);
  return result;
}

}  // namespace millrace::bench
