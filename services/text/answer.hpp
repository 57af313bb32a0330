// The format of error texts, and the states that all services of this folder share.
//
//   return error(state_unknown_gauge, "no gauge " + in_quotes(name));
//   → state 11, text "ERROR: no gauge 'depht'"
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "services/sdk/response.hpp"

namespace millrace::services::text {

/// The response contains what was requested.
inline constexpr std::uint32_t state_ok = 1;
/// The service does not understand the request.
inline constexpr std::uint32_t state_bad_request = sdk::bad_request_state;

/// "ERROR: MESSAGE". A message that does not fit is truncated and ends in "..." at byte 127.
sdk::Response error(std::uint32_t state, std::string_view message);

/// `text`, truncated with "..." if it has more than 127 bytes.
std::string fitting(std::string text);

/// 'text' for use in a message: unprintable bytes become '?', more than 32 bytes are truncated with
/// "...".
std::string in_quotes(std::string_view text);

/// True for the printable bytes of CP1252, without controls and the five undefined bytes.
bool prints(char c);

}  // namespace millrace::services::text
