// The return value of a handler.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace millrace::services::sdk {

/// The state of an answer for a failure of the service itself, unless it names another.
inline constexpr std::uint32_t default_error_state = 500;
/// That of millrace's own services for a request that they do not understand.
inline constexpr std::uint32_t bad_request_state = 10;

/// The answer to a call: V.G.SERVICE.RESPONSE and V.G.SERVICE.RESPONSE_STATE of the channel.
struct Response {
  /// At most 127 bytes in the controller's code page, CP1252, without NUL.
  std::string text{};
  /// Not 0, which would not release the NC program, unless its NC programs wait for RESPONSE
  /// (ServiceOptions::completion_signal); other meanings are between NC program and service.
  std::uint32_t state = 1;
  bool operator==(const Response&) const = default;

  /// Of a UTF-8 text. Throws std::invalid_argument, which names the first character that CP1252
  /// does not have.
  static Response utf8(std::string_view text, std::uint32_t state = 1);
  /// With the text "ERROR: " and `reason` (CP1252); "..." replaces what does not fit.
  static Response error(std::string_view reason, std::uint32_t state = default_error_state);
};

}  // namespace millrace::services::sdk
