// Requests as a controller makes them, from the members that a test names.
#pragma once

#include <stdexcept>
#include <string>

#include "fabric/messages.hpp"

namespace millrace::services::sdk::testing {

/// Throws std::invalid_argument for a text that no NC program can send.
inline fabric::Request complete(fabric::Request request) {
  if (request.text.size() > fabric::max_text) {
    throw std::invalid_argument("a request of " + std::to_string(request.text.size()) +
                                " bytes; a controller's string holds 127");
  }
  if (request.key.machine.empty()) {
    request.key.machine = "cnc";
  }
  if (request.key.channel == 0) {
    request.key.channel = 1;
  }
  if (request.call == fabric::CallId{}) {
    request.call = {.epoch = 0x7e57, .number = 1};
  }
  if (request.state == 0) {
    request.state = 1;
  }
  return request;
}

}  // namespace millrace::services::sdk::testing
