// The Service Interface of one channel: its five variables and the kernel's rules about them.
//
//   ServiceInterface service(store.family(Kind::global), rules, clock, on_answered);
//
// A program writes UUID and REQUEST, then REQUEST_STATE ≠ 0, and waits for RESPONSE_STATE ≠ 0; a
// service writes RESPONSE and RESPONSE_STATE over ADS (IB/tf5200_service_interface/356533387,
// documented).
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "cnc/simulator/store.hpp"

namespace millrace::cnc::simulator {

/// Time since any fixed moment.
using Clock = std::function<std::chrono::nanoseconds()>;

/// What the vendor does not document; each default changes nothing that is not documented.
struct ServiceRules {
  /// An ADS write of RESPONSE_STATE ≠ 0 also sets REQUEST_STATE to 0. Documented is only that "the
  /// Service Interface" does it once the service is done, not which side of it.
  bool response_clears_request = false;
  /// An ADS write of REQUEST_STATE sets RESPONSE_STATE to 0, as a program's write does.
  bool ads_request_clears_response = false;
  /// An NC reset sets both states to 0.
  bool reset_clears_states = false;
  /// The start of a program sets both states to 0.
  bool start_clears_states = false;
};

/// A call as the program saw it: from writing REQUEST_STATE ≠ 0 to the first RESPONSE_STATE ≠ 0.
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

  /// NC reset.
  void reset();
  /// A program starts.
  void start();

 private:
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
  struct PendingCall {
    std::string uuid;
    std::chrono::nanoseconds since{};
  };
  std::optional<PendingCall> pending_;
};

}  // namespace millrace::cnc::simulator
