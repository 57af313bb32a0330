// The Service Interface of one channel as the kernel keeps it, with both sides' rules, for tests
// that need no controller.
//
//   ServiceInterface channel({.auto_clear = true});
//   channel.call({"560aacbf-…", "hello", 1});         // the program
//   channel.write(Variable::response_state, 1U);      // over ADS
#pragma once

#include <string>
#include <variant>

#include "gateway/snapshot.hpp"

namespace millrace::tests {

/// What the vendor's pages leave open (IB/tf5200_service_interface/356533387.html); the gateway
/// must work with each.
struct KernelRules {
  /// Writing RESPONSE_STATE over ADS sets REQUEST_STATE to 0.
  bool auto_clear = false;
  /// Writing REQUEST_STATE over ADS sets RESPONSE_STATE to 0, as the program's write does.
  bool ads_clears = false;
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
  }
  void set_uuid(const std::string& uuid) { values_.uuid = uuid; }
  void set_request(const std::string& text) { values_.request = text; }
  /// A controller that starts again.
  void reset() { values_ = {}; }

  [[nodiscard]] const gateway::Snapshot& values() const { return values_; }

  [[nodiscard]] gateway::Snapshot read(gateway::ReadSet look) const {
    gateway::Snapshot picture;
    picture.look = look;
    for (const gateway::Variable variable : gateway::variables_of(look)) {
      copy(variable, picture);
    }
    return picture;
  }

  void write(gateway::Variable variable, const gateway::Value& value) {
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
        break;
      case gateway::Variable::uuid:
        values_.uuid = std::get<std::string>(value);
        break;
      case gateway::Variable::request:
        values_.request = std::get<std::string>(value);
        break;
    }
  }

 private:
  void copy(gateway::Variable variable, gateway::Snapshot& picture) const {
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
  gateway::Snapshot values_;
};

}  // namespace millrace::tests
