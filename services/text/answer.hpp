// The one form of error texts, and what states mean in every service of this folder.
//
//   return error(state_unknown_gauge, "no gauge " + in_quotes(name));
//   → state 11, text "ERROR: no gauge 'depht'"
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "services/sdk/response.hpp"

namespace millrace::services::text {

/// The answer carries what was asked for.
inline constexpr std::uint32_t state_ok = 1;
/// The service does not understand the request.
inline constexpr std::uint32_t state_bad_request = 10;

/// "ERROR: MESSAGE". A message that does not fit ends in "..." at byte 127, so that its cut shows.
sdk::Response error(std::uint32_t state, std::string_view message);

/// `text`, or its start and "..." if it is more than 127 bytes.
std::string fitting(std::string text);

/// 'text' for use in a message: bytes that do not print become '?', more than 32 bytes end in
/// "...".
std::string in_quotes(std::string_view text);

/// True for the bytes that CP1252 shows; controls and the five bytes it leaves open are not.
bool prints(char c);

}  // namespace millrace::services::text
