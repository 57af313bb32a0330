// The Service Interface of one channel, with the rules for both sides as in the kernel, for tests
// that need no controller.
//
//   ServiceInterface channel({.auto_clear = true});
//   channel.call({"560aacbf-…", "hello", 1});         // the program
//   channel.write(Variable::response_state, 1U);      // over ADS
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "gateway/moment.hpp"
#include "gateway/service_snapshot.hpp"

namespace millrace::tests {

/// The vendor's pages leave these rules open (IB/tf5200_service_interface/356533387.html); the
/// gateway must work with each.
struct KernelRules {
  /// Writing RESPONSE_STATE over ADS sets REQUEST_STATE to 0.
  bool auto_clear = false;
  /// Writing REQUEST_STATE over ADS sets RESPONSE_STATE to 0, as the program's write does.
  bool ads_clears = false;
  /// The time between acknowledgement and effect of an ADS write of these variables.
  std::chrono::milliseconds response_after{0};
  std::chrono::milliseconds request_state_after{0};
  std::chrono::milliseconds response_state_after{0};
  /// The kernel sets REQUEST_STATE to 0 this long after a write of RESPONSE_STATE ≠ 0 has taken
  /// effect, unless the program has written it since, and ignores writes of 0 over ADS.
  std::optional<std::chrono::milliseconds> kernel_clears_after{};
};

class ServiceInterface {
 public:
  explicit ServiceInterface(KernelRules rules = {}) : rules_(rules) {}

  /// The program writes UUID, REQUEST and REQUEST_STATE, in this order.
  void call(const gateway::PendingRequest& request) {
    values_.uuid = request.uuid;
    values_.request = request.text;
    set_request_state(request.state);
  }
  /// The program writes REQUEST_STATE, which sets RESPONSE_STATE to 0 (documented).
  void set_request_state(std::uint32_t state) {
    values_.request_state = state;
    values_.response_state = 0;
    clears_at_.reset();
  }
  void set_uuid(const std::string& uuid) { values_.uuid = uuid; }
  void set_request(const std::string& text) { values_.request = text; }
  void set_response(const std::string& text) { values_.response = text; }
  /// The controller restarts.
  void reset() {
    values_ = {};
    late_.clear();
    clears_at_.reset();
  }
  /// Applies the writes that are due.
  void advance(gateway::SteadyTime now) {
    now_ = now;
    for (auto first = late_.begin(); first != late_.end();) {
      if (first->due <= now) {
        apply(first->variable, first->value);
        first = late_.erase(first);
      } else {
        ++first;
      }
    }
    if (clears_at_ && *clears_at_ <= now) {
      clears_at_.reset();
      values_.request_state = 0;
    }
  }

  [[nodiscard]] const gateway::ServiceSnapshot& values() const { return values_; }

  [[nodiscard]] gateway::ServiceSnapshot read(gateway::ReadSet set) const {
    gateway::ServiceSnapshot picture;
    picture.set = set;
    for (const gateway::Variable variable : gateway::variables_of(set)) {
      copy(variable, picture);
    }
    return picture;
  }

  void write(gateway::Variable variable, const gateway::Value& value) {
    if (variable == gateway::Variable::request_state && rules_.kernel_clears_after &&
        value == gateway::Value{std::uint32_t{0}}) {
      return;
    }
    late_.push_back({now_ + delay_of(variable), variable, value});
    advance(now_);
  }

 private:
  struct Late {
    gateway::SteadyTime due{};
    gateway::Variable variable{};
    gateway::Value value;
  };

  [[nodiscard]] std::chrono::milliseconds delay_of(gateway::Variable variable) const {
    switch (variable) {
      case gateway::Variable::response:
        return rules_.response_after;
      case gateway::Variable::request_state:
        return rules_.request_state_after;
      case gateway::Variable::response_state:
        return rules_.response_state_after;
      default:
        return {};
    }
  }

  void apply(gateway::Variable variable, const gateway::Value& value) {
    switch (variable) {
      case gateway::Variable::response:
        values_.response = std::get<std::string>(value);
        break;
      case gateway::Variable::request_state:
        values_.request_state = std::get<std::uint32_t>(value);
        if (rules_.ads_clears) {
          values_.response_state = 0;
        }
        break;
      case gateway::Variable::response_state:
        values_.response_state = std::get<std::uint32_t>(value);
        if (rules_.auto_clear) {
          values_.request_state = 0;
        }
        if (rules_.kernel_clears_after && values_.response_state != 0) {
          clears_at_ = now_ + *rules_.kernel_clears_after;
        }
        break;
      case gateway::Variable::uuid:
        values_.uuid = std::get<std::string>(value);
        break;
      case gateway::Variable::request:
        values_.request = std::get<std::string>(value);
        break;
    }
  }

  void copy(gateway::Variable variable, gateway::ServiceSnapshot& picture) const {
    switch (variable) {
      case gateway::Variable::uuid:
        picture.uuid = values_.uuid;
        break;
      case gateway::Variable::request:
        picture.request = values_.request;
        break;
      case gateway::Variable::request_state:
        picture.request_state = values_.request_state;
        break;
      case gateway::Variable::response_state:
        picture.response_state = values_.response_state;
        break;
      case gateway::Variable::response:
        picture.response = values_.response;
        break;
    }
  }

  KernelRules rules_;
  gateway::ServiceSnapshot values_;
  gateway::SteadyTime now_{};
  std::vector<Late> late_;
  std::optional<gateway::SteadyTime> clears_at_;
};

}  // namespace millrace::tests
