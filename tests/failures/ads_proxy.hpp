// A TCP proxy between a gateway and a controller. It stops at one chosen frame, so that a test can
// break something at exactly that point of a call, and it can break connections.
//
//   AdsProxy proxy;                                    // the gateway connects to proxy.port()
//   proxy.lead_to(cnc_port);
//   proxy.arm(write_of("V.G.SERVICE.RESPONSE"));
//   ASSERT_TRUE(proxy.await_held());                   // the frame is here, and not yet there
//   proxy.cut_before();                                // or release(), cut_after(), …
//
// It sees no frames of Secure ADS: there it stops at any bytes.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "tests/support/process.hpp"

namespace millrace::tests {

/// A frame from the gateway to its controller.
struct Spot {
  /// A write, or a read, of this variable.
  bool write = false;
  std::string variable{};
  /// The value that is written, for states.
  std::optional<std::uint32_t> value{};
  /// 1 = the first such frame from now on.
  int occurrence = 1;
};

inline Spot write_of(std::string variable, std::optional<std::uint32_t> value = {},
                     int occurrence = 1) {
  return {true, std::move(variable), value, occurrence};
}
inline Spot read_of(std::string variable, int occurrence = 1) {
  return {false, std::move(variable), {}, occurrence};
}

enum class Sees { frames, bytes };

/// All functions may be called from any thread. Connections made after a fault are healthy.
class AdsProxy {
 public:
  /// Listens on a free port of the loopback interface.
  explicit AdsProxy(Sees sees = Sees::frames);
  ~AdsProxy();
  AdsProxy(const AdsProxy&) = delete;
  AdsProxy& operator=(const AdsProxy&) = delete;

  [[nodiscard]] std::uint16_t port() const;
  /// Where connections lead from now on; before, they are closed at once.
  void lead_to(std::uint16_t port);

  /// Holds the next such frame and all that follow it.
  void arm(Spot spot);
  /// The same with the next bytes, for a proxy that sees no frames.
  void arm() { arm(Spot{}); }
  /// True once the frame is held.
  bool await_held(std::chrono::milliseconds timeout = patience);
  /// Forwards what is held.
  void release();
  /// The same, unless the gateway has given up its connection: TCP delivers nothing of it then.
  void release_if_connected();
  /// Drops the frame and cuts the connection.
  void cut_before();
  /// The controller executes the frame and the connection is cut before its response.
  void cut_after();
  /// From here on, neither side receives anything from the other; the connection stays open.
  void go_silent();
  /// The same, after the controller has executed the frame.
  void go_silent_after();

  /// What a path whose controller answers nothing sends instead: every 0.2 s, or for each request.
  enum class Chatter {
    /// Requests for the state of the gateway's AMS port 10000, as TwinCAT routers send them.
    state_requests,
    /// The gateway's own frames, as they were sent.
    mirrored_frames,
    /// Device notifications of the gateway's controller; those of the controller pass, too.
    notifications,
    /// The router's error 6 for each request: nothing is registered at this AMS port.
    router_errors,
  };
  /// From now on, in each connection: the controller gets no frame, and no response passes.
  void answer_nothing(Chatter chatter);
  /// Connections are healthy again.
  void answer();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::tests
