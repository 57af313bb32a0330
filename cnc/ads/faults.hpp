// What a server can do wrong on purpose, so that clients can be tried. All off by default.
//
//   server.set_faults({.delay = 50ms, .drop_every = 10});
#pragma once

#include <chrono>
#include <deque>
#include <optional>

#include "cnc/ads/bytes.hpp"
#include "cnc/ads/connect_info.hpp"

namespace millrace::cnc::ads {

struct Faults {
  /// Each answer, and each frame of notifications, is sent this much later.
  std::chrono::milliseconds delay{0};
  /// Every n-th of them on a connection is not sent; 0 = none, 1 = all of them.
  std::uint32_t drop_every = 0;
  /// Every other one waits for twice the delay, so that the next one overtakes it.
  bool out_of_order = false;
  /// They leave in segments of so many bytes; 0 = as they are.
  std::size_t segment = 0;
  /// Each new connection is closed as soon as it is made.
  bool refuse_connections = false;
};

/// … before the first frame of Secure ADS.
struct SecureFaults {
  /// Before the server's part of the TLS handshake.
  std::chrono::milliseconds handshake_delay{0};
  bool close_after_handshake = false;
  /// Each TlsConnectInfo is answered with this.
  ConnectError answer = ConnectError::none;
  /// … with 64 bytes that are none.
  bool garbage = false;
  /// … with so many bytes less.
  std::size_t missing_bytes = 0;
  /// A connection that comes sooner after the one before is closed before the handshake, and has
  /// the next one wait as long.
  std::chrono::milliseconds least_pause{0};
};

/// The answers of one connection on their way through its faults. Pure.
class FaultyLine {
 public:
  using Time = std::chrono::steady_clock::time_point;

  void push(Bytes answer, const Faults& faults, Time now);
  /// What is to be sent by now.
  Bytes take(Time now);
  [[nodiscard]] std::optional<Time> next_due() const;
  /// Bytes on their way.
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  struct Answer {
    Time due;
    Bytes bytes;
  };

  std::deque<Answer> answers_;
  std::size_t size_ = 0;
  std::uint64_t count_ = 0;
};

}  // namespace millrace::cnc::ads
