// The return value of a handler.
#pragma once

#include <cstdint>
#include <string>

#include <tl/expected.hpp>

namespace millrace::services::sdk {

/// The answer to a call: V.G.SERVICE.RESPONSE and V.G.SERVICE.RESPONSE_STATE of the channel.
struct Response {
  /// At most 127 bytes in the controller's code page, CP1252, without NUL.
  std::string text{};
  /// Not 0, which would not release the NC program, unless its NC programs wait for RESPONSE
  /// (ServiceOptions::completion_signal); other meanings are between NC program and service.
  std::uint32_t state = 1;
  bool operator==(const Response&) const = default;
};

/// How a handler ended: its response, or why there is none.
using Result = tl::expected<Response, std::string>;

}  // namespace millrace::services::sdk
