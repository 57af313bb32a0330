// When a connection's requests were last answered, and by whom. Pure.
//
// A response proves that the controller lives only if its router delivered the request. A router
// also answers for a CNC that does not run: 6 (port not found) or 7 (machine not found).
//
//   signs.answered(552, true, now);
//   signs.not_delivered(552, ErrorCode::target_port_not_found, now);
//   if (const auto dead = signs.refused(now)) …        // for a timeout nothing else came
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "cnc/ads/error.hpp"

namespace millrace::cnc::ads {

class SignsOfLife {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// `port` is the AMS port whose response established the connection. Only this port can prove
  /// that the controller runs, or that it does not: a PLC of the same router may come and go.
  SignsOfLife(std::uint16_t port, std::chrono::nanoseconds timeout)
      : port_(port), timeout_(timeout) {}

  /// A connection begins.
  void begin(Time now) {
    answered_at_ = in_time_at_ = now;
    refused_.reset();
  }
  /// A port of the controller has responded, in time or after the timeout of the request.
  void answered(std::uint16_t port, bool in_time, Time now) {
    answered_at_ = now;
    if (in_time) {
      in_time_at_ = now;
    }
    if (port == port_) {
      refused_.reset();
    }
  }
  /// The router has responded that it could not deliver a request to this port.
  void not_delivered(std::uint16_t port, ErrorCode error, Time now) {
    if (port == port_) {
      refused_ = Refused{error, refused_ ? refused_->since : now};
    }
  }

  [[nodiscard]] std::chrono::nanoseconds silent_for(Time now) const { return now - answered_at_; }
  [[nodiscard]] std::chrono::nanoseconds late_for(Time now) const { return now - in_time_at_; }

  struct Refused {
    /// The router's newest error.
    ErrorCode error{};
    Time since{};
  };
  /// Since a timeout or longer, the router has delivered no request to the port.
  [[nodiscard]] std::optional<Refused> refused(Time now) const {
    return refused_ && now - refused_->since >= timeout_ ? refused_ : std::nullopt;
  }

 private:
  std::uint16_t port_;
  std::chrono::nanoseconds timeout_;
  /// The last response, and the last one in time; the begin of the connection before that.
  Time answered_at_{};
  Time in_time_at_{};
  std::optional<Refused> refused_;
};

}  // namespace millrace::cnc::ads
