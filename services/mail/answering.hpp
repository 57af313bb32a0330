// Decides what is stored of a mail after an attempt, and the response to the NC program. Pure.
//
// States (docs/reference/services/mail.md): 1 the server has accepted the mail; 2 the mail waits in
// the spool; 10 request not understood; 11 unknown template; 12 a key of the template is missing or
// unknown; 13 unknown recipient; 14 refused by the server permanently; 15 no safe connection; 16 no
// login; 17 handed over without a reply of the server; 18 the spool cannot be written.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "services/mail/config.hpp"
#include "services/mail/mail.hpp"
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

/// The entry after an attempt that began while it was waiting. Nullopt if the mail could not even
/// be tried (insecure, login) while the NC program still waits for the response. In the same case a
/// mail without a waiting program stays in the spool.
std::optional<Entry> after(Entry entry, const Outcome& outcome, const RetryPolicy& policy,
                           bool program_waits, fabric::Time now);

/// The response to the outcome of an attempt.
sdk::Response answer_to(const Outcome& outcome);

/// The response to a call that is in the spool.
sdk::Response answer_from(const Entry& entry);

/// The pause before the next attempt, after this number of attempts.
std::chrono::milliseconds pause_after(std::uint32_t attempts, const RetryPolicy& policy);

}  // namespace millrace::services::mail
