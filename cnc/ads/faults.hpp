// Faults that a server makes deliberately, to test clients. All are off by default.
#pragma once

#include <chrono>
#include <deque>
#include <optional>

#include "cnc/ads/bytes.hpp"
#include "cnc/ads/connect_info.hpp"

namespace millrace::cnc::ads {

struct Faults {
  /// Delay of each response, and of the notifications that are due at the same time.
  std::chrono::milliseconds delay{0};
  /// Every n-th of these on a connection is not sent; 0 = none, 1 = all of them.
  std::uint32_t drop_every = 0;
  /// Every other one waits for twice the delay, so that the next one overtakes it. Without delay it
  /// has no effect.
  bool out_of_order = false;
  /// Frames are sent in segments of this many bytes; 0 = unchanged.
  std::size_t segment = 0;
  /// The server closes each new connection at once.
  bool refuse_connections = false;
};

/// Faults before the first frame of Secure ADS.
struct SecureFaults {
  /// Delay before the server's part of the TLS handshake.
  std::chrono::milliseconds handshake_delay{0};
  bool close_after_handshake = false;
  /// Response to each TlsConnectInfo.
  ConnectError answer = ConnectError::none;
  /// The response is 64 bytes that are not a TlsConnectInfo.
  bool garbage = false;
  /// The response is this many bytes too short.
  std::size_t missing_bytes = 0;
  /// A connection that comes sooner than this after the previous one is closed before the
  /// handshake, and restarts the pause for the next one.
  std::chrono::milliseconds least_pause{0};
};

/// The delayed responses of one connection. Pure.
class FaultyLine {
 public:
  using Time = std::chrono::steady_clock::time_point;

  void push(Bytes answer, const Faults& faults, Time now);
  /// The bytes to send by now.
  Bytes take(Time now);
  [[nodiscard]] std::optional<Time> next_due() const;
  /// Bytes not sent yet.
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
