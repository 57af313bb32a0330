// Between a call and a program: what the program is given, and what its end means.
//
//   const auto command = command_for(script, call);       // or the answer to a bad request
//   const Verdict v = verdict(script, run(*command, limits_for(script)));
//
// The rule of states (docs/services.md):
//   1           exit code 0; the text is the output
//   100 + n     exit code n; the text is the output, or says the code if there is none
//   400 + n     ended by signal n
//   10          the request cannot be given to a program
//   11          the time limit was reached
//   12          it could not be started
//   13          its output cannot be an answer: too long, or not in the controller's code page
//   14          the call was withdrawn while it ran; the program was ended
#pragma once

#include <cstdint>
#include <string>

#include <tl/expected.hpp>

#include "services/batch/process.hpp"
#include "services/batch/script.hpp"
#include "services/text/answer.hpp"

namespace millrace::services::batch {

inline constexpr std::uint32_t state_time_limit = 11;
inline constexpr std::uint32_t state_not_started = 12;
inline constexpr std::uint32_t state_output_refused = 13;
inline constexpr std::uint32_t state_withdrawn = 14;
inline constexpr std::uint32_t state_exit_code = 100;
inline constexpr std::uint32_t state_signal = 400;

/// What the batch service needs to know of a call.
struct CallInfo {
  /// CP1252, at most 127 bytes.
  std::string request;
  std::uint32_t state = 0;
  std::string id{};
  std::uint32_t attempt = 1;
  std::string machine{};
  std::uint16_t channel = 0;
  bool replayed = false;
};

/// The program with the request as its last argument and as one line of standard input, and the
/// call in its environment (MILLRACE_CALL, _ATTEMPT, _MACHINE, _CHANNEL, _STATE, _REPLAYED). The
/// error is the answer to a request that cannot be an argument.
tl::expected<Command, sdk::Response> command_for(const Script& script, const CallInfo& call);

Limits limits_for(const Script& script);

struct Verdict {
  /// At most 127 bytes. Trailing line ends of the output are not part of it.
  sdk::Response answer;
  /// What the operator should know besides (cut output, standard error); empty if nothing.
  std::string remark{};
};

Verdict verdict(const Script& script, const Ended& ended);

}  // namespace millrace::services::batch
