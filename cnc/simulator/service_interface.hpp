// The Service Interface of one channel: its five variables and the kernel's rules for them.
//
//   ServiceInterface service(store.family(Kind::global), rules, clock, on_answered);
//
// An NC program writes UUID and REQUEST, then REQUEST_STATE ≠ 0, and waits for RESPONSE_STATE ≠ 0.
// A service writes RESPONSE and RESPONSE_STATE over ADS (IB/tf5200_service_interface/356533387,
// documented).
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "cnc/simulator/store.hpp"

namespace millrace::cnc::simulator {

/// Time since any fixed moment.
using Clock = std::function<std::chrono::nanoseconds()>;

/// Behaviour that the vendor does not document; with the defaults the kernel does only what is
/// documented.
struct ServiceRules {
  /// An ADS write of RESPONSE_STATE ≠ 0 also sets REQUEST_STATE to 0. The documentation states only
  /// that "the Service Interface" does it once the service is done, not which side of it.
  bool response_clears_request = false;
  /// An ADS write of REQUEST_STATE sets RESPONSE_STATE to 0, as an NC program's write does.
  bool ads_request_clears_response = false;
  /// An NC reset sets both states to 0.
  bool reset_clears_states = false;
  /// The start of an NC program sets both states to 0.
  bool start_clears_states = false;
  /// Delay between the acknowledgement of an ADS write and its effect.
  std::chrono::nanoseconds writes_visible_after{0};
  /// Delay after an ADS write of RESPONSE_STATE ≠ 0 until the kernel sets REQUEST_STATE to 0,
  /// unless the NC program has written it since. With a value, ADS writes of 0 to REQUEST_STATE are
  /// ignored.
  std::optional<std::chrono::nanoseconds> kernel_clears_after{};
};

/// A call from the view of the NC program: from its write of REQUEST_STATE ≠ 0 to the first
/// RESPONSE_STATE ≠ 0.
struct AnsweredCall {
  /// Counts the answered calls of the channel from 1.
  std::uint64_t number = 0;
  std::string uuid;
  std::chrono::nanoseconds duration{};
};

class ServiceInterface {
 public:
  /// Adds the five variables to `globals`, which must outlive this object.
  ServiceInterface(Family& globals, ServiceRules rules, Clock clock,
                   std::function<void(const AnsweredCall&)> on_answered);
  ServiceInterface(const ServiceInterface&) = delete;
  ServiceInterface& operator=(const ServiceInterface&) = delete;

  /// Applies the writes that are due. Call it before any read, and in each cycle.
  void advance(std::chrono::nanoseconds now);
  /// NC reset.
  void reset();
  /// An NC program starts.
  void start();

 private:
  using Apply = std::function<void()>;

  void clear_states();
  void request_written(Writer writer);
  void response_written(Writer writer);

  std::shared_ptr<Variable> uuid_;
  std::shared_ptr<Variable> request_state_;
  std::shared_ptr<Variable> response_state_;
  ServiceRules rules_;
  Clock clock_;
  std::function<void(const AnsweredCall&)> on_answered_;
  std::uint64_t answered_ = 0;
  /// Writes of ADS clients that have not taken effect yet, in their order.
  struct LateWrite {
    std::chrono::nanoseconds due{};
    Apply apply;
  };
  std::deque<LateWrite> late_writes_;
  std::optional<std::chrono::nanoseconds> clears_at_;
  struct PendingCall {
    std::string uuid;
    std::chrono::nanoseconds since{};
  };
  std::optional<PendingCall> pending_;
};

}  // namespace millrace::cnc::simulator
