// Converts a call to the command of a script, and the end of its process to a response.
//
//   const auto command = command_for(script, call);       // or the response to a bad request
//   const Verdict v = verdict(script, run(*command, limits_for(script)));
//
// States (docs/reference/services/batch.md):
//   1           exit code 0; the text is the output
//   100 + n     exit code n; the text is the output, or the code if there is none
//   400 + n     ended by signal n
//   10          the request cannot be passed to a process
//   11          the time limit was reached
//   12          the process could not be started
//   13          the output cannot be a response: too long, or not in the controller's code page
//   14          the call was cancelled while the process ran; the process was ended
#pragma once

#include <cstdint>
#include <string>

#include <tl/expected.hpp>

#include "services/batch/config.hpp"
#include "services/batch/process.hpp"
#include "services/text/answer.hpp"

namespace millrace::services::batch {

inline constexpr std::uint32_t state_time_limit = 11;
inline constexpr std::uint32_t state_not_started = 12;
inline constexpr std::uint32_t state_output_refused = 13;
inline constexpr std::uint32_t state_withdrawn = 14;
inline constexpr std::uint32_t state_exit_code = 100;
inline constexpr std::uint32_t state_signal = 400;

/// The script with the request as its last argument and as one line of standard input, and the call
/// in its environment (MILLRACE_CALL, _ATTEMPT, _MACHINE, _CHANNEL, _STATE, _REPLAYED). The error
/// is the response to a request that cannot be an argument.
tl::expected<Command, sdk::Response> command_for(const Script& script, const fabric::Request& call);

Limits limits_for(const Script& script);

struct Verdict {
  /// At most 127 bytes, without trailing line ends of the output.
  sdk::Response answer;
  /// Additional information for the operator (truncated output, standard error); empty if there is
  /// none.
  std::string remark{};
};

Verdict verdict(const Script& script, const Ended& ended);

}  // namespace millrace::services::batch
