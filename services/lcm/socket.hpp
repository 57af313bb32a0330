// The bridge's sockets on LCM's multicast group, driven by our loop.
//
//   Socket socket(loop, network, listener);
//   socket.publish("MILLRACE_REQUEST.560aacbf-…", bytes);
//
// liblcm itself uses a receiving thread and a pipe to the handler, receives from every sender on
// the network, and leaves the choice of the interface to the routes: docs/dev/decisions/lcm.md.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <tl/expected.hpp>

#include "services/lcm/bridge.hpp"
#include "services/lcm/config.hpp"

namespace millrace::services::lcm {

/// Called on the loop.
class SocketListener {
 public:
  virtual ~SocketListener() = default;
  virtual void on_packet(std::string_view channel, std::string_view bytes, Sender sender) = 0;
  virtual void on_fragment(std::string_view channel, Sender sender) = 0;
  /// With a ttl of 0: a datagram from another host, which is not read.
  virtual void on_foreign(Sender sender) = 0;
};

class Socket {
 public:
  /// Throws std::runtime_error, with advice, if joining the group fails. Loop and listener must
  /// outlive it.
  Socket(boost::asio::io_context& loop, const Network& network, SocketListener& listener);

  /// Does not wait; from any thread. The error is the system's: the message is lost.
  tl::expected<void, std::string> publish(std::string_view channel, std::string_view bytes);

 private:
  static constexpr std::size_t longest_datagram = 65'536;

  void open();
  void wait();
  void read();
  void take(std::string_view datagram, const boost::asio::ip::udp::endpoint& from);
  /// Reads the addresses of this host again for an unknown one, at most once a second.
  [[nodiscard]] bool is_local(std::uint32_t address, std::chrono::steady_clock::time_point now);

  const Network network_;
  SocketListener& listener_;
  const boost::asio::ip::udp::endpoint group_;
  boost::asio::ip::udp::socket in_;
  boost::asio::ip::udp::socket out_;
  std::set<std::uint32_t> addresses_;
  std::chrono::steady_clock::time_point looked_{};
  std::atomic<std::uint32_t> number_ = 0;
  std::array<char, longest_datagram> buffer_{};
};

}  // namespace millrace::services::lcm
