// The texts of simulated services, which distinguish each program's answer from others.
#pragma once

#include <cstdint>
#include <string>

#include <fmt/format.h>

namespace millrace::tests::simulation {

inline constexpr std::uint32_t first_interim = 1000;
inline constexpr std::uint32_t last_interim = 1003;

/// These states leave the program waiting.
constexpr bool is_interim(std::uint32_t state) {
  return state >= first_interim && state <= last_interim;
}

/// The beginning of the answer to a request, with the three variables of the request.
inline std::string answer_to(const std::string& uuid, const std::string& text,
                             std::uint32_t state) {
  return fmt::format("re {}; {} {};", text, uuid.substr(0, 8), state);
}
template <typename Request>
std::string answer_to(const Request& request) {
  return answer_to(request.uuid, request.text, request.state);
}

/// The end of an interim answer.
inline constexpr const char* in_progress = " soon";

/// The SDK's error for this answer.
inline std::string failure_of(const std::string& answer) {
  return "cannot do " + answer;
}

/// The SDK's answer for a handler that was cancelled and must not run twice.
inline constexpr const char* given_up = "ERROR: the call was cancelled while it ran";

/// The beginning of what a handler returns after its cancellation.
inline constexpr const char* unwanted = "cancelled: ";

/// The beginning of an unrequested reply.
inline constexpr const char* strange = "stranger: ";

/// What a program gets in place of an invalid answer; it does not repeat the request.
inline bool stands_for_a_refused_one(const std::string& answer) {
  return answer.starts_with("ERROR: the service") ||
         answer.starts_with("ERROR: the answer in the journal");
}

/// The gateway, or an operator, has answered in the service's place.
inline bool is_settlement(const std::string& answer) {
  return answer.starts_with("millrace: ") || answer.starts_with("operator: ");
}

template <typename Request>
bool answers(const std::string& answer, const Request& request) {
  return answer.find(answer_to(request)) != std::string::npos || is_settlement(answer) ||
         stands_for_a_refused_one(answer) || answer.starts_with(given_up);
}

}  // namespace millrace::tests::simulation
