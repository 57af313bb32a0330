// What a gateway tells of a call, for benchmarks that stand in for one.
//
//   end.publish(event_of(request, fabric::EventKind::seen));
#pragma once

#include <chrono>

#include "fabric/messages.hpp"

namespace millrace::bench {

/// Of the first attempt, now.
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
