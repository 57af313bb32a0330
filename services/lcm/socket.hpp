// The bridge's sockets on LCM's multicast group, driven by our loop.
//
//   Socket socket(loop, network, listener);
//   socket.publish("MILLRACE_REQUEST.560aacbf-…", bytes);
//
// liblcm itself uses a receiving thread and a pipe to the handler, receives from every sender on
// the network, and leaves the choice of the interface to the routes: docs/dev/decisions/lcm.md.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "services/lcm/bridge.hpp"
#include "services/lcm/config.hpp"

namespace boost::asio {
class io_context;
}

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
  ~Socket();
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  /// Does not wait; from any thread. The error is the system's: the message is lost.
  tl::expected<void, std::string> publish(std::string_view channel, std::string_view bytes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The IPv4 addresses of this host.

class LocalAddresses {
 public:
  /// Reads the addresses again for an unknown one, at most once a second.
  bool has(std::uint32_t address, std::chrono::steady_clock::time_point now);

 private:
  std::set<std::uint32_t> known_;
  std::chrono::steady_clock::time_point looked_{};
};

}  // namespace millrace::services::lcm
