// From the outcome of an attempt to what is kept of the mail and what the program is told. Pure.
//
// States (docs/services.md): 1 the server has taken the mail; 2 it waits in the spool; 10 request
// not understood; 11 unknown template; 12 a key of the template is missing or unknown; 13 unknown
// recipient; 14 refused by the server for good; 15 no safe connection; 16 no login; 17 handed over,
// but no answer came; 18 the spool cannot be written.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "services/mail/config.hpp"
#include "services/mail/mail.hpp"
#include "services/mail/outcome.hpp"
#include "services/sdk/response.hpp"
#include "services/text/answer.hpp"

namespace millrace::services::mail {

inline constexpr std::uint32_t state_kept = 2;
inline constexpr std::uint32_t state_unknown_template = 11;
inline constexpr std::uint32_t state_wrong_keys = 12;
inline constexpr std::uint32_t state_unknown_recipient = 13;
inline constexpr std::uint32_t state_refused = 14;
inline constexpr std::uint32_t state_insecure = 15;
inline constexpr std::uint32_t state_no_login = 16;
inline constexpr std::uint32_t state_doubt = 17;
inline constexpr std::uint32_t state_spool = 18;

/// The entry after an attempt that began while it was waiting. Nothing is kept of a mail that could
/// not even be tried (insecure, login) while the program still waits for the answer; one that the
/// program was told is kept goes on waiting.
std::optional<Entry> after(Entry entry, const Outcome& outcome, const RetryPolicy& policy,
                           bool program_waits, fabric::Time now);

/// What the program is told of an attempt's outcome.
sdk::Response answer_to(const Outcome& outcome);

/// What the program is told of a call that is in the spool.
sdk::Response answer_from(const Entry& entry);

/// How long a mail waits after so many attempts.
std::chrono::milliseconds pause_after(std::uint32_t attempts, const RetryPolicy& policy);

}  // namespace millrace::services::mail
