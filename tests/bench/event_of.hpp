// A gateway's event about a call, for benchmarks that replace a gateway.
//
//   end.publish(event_of(request, fabric::EventKind::seen));
#pragma once

#include <chrono>

#include "fabric/messages.hpp"

namespace millrace::bench {

/// About the first attempt, at this moment.
inline fabric::Event event_of(const fabric::Request& request, fabric::EventKind kind) {
  return {.key = request.key,
          .call = request.call,
          .attempt = 1,
          .kind = kind,
          .at = std::chrono::system_clock::now(),
          .instance = request.assigned,
          .uuid = request.uuid,
          .text = request.text,
          .state = 1};
}

}  // namespace millrace::bench
