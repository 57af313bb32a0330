// From a call to the mail it asks for. Pure.
#pragma once

#include <cstdint>
#include <set>
#include <string>

#include <tl/expected.hpp>

#include "services/mail/config.hpp"
#include "services/mail/mail.hpp"
#include "services/sdk/response.hpp"

namespace millrace::services::mail {

/// What the mail service needs to know of a call.
struct CallInfo {
  fabric::CallId call{};
  fabric::ChannelKey key{};
  std::uint32_t state = 0;
  /// CP1252.
  std::string request{};
  bool replayed = false;
};

/// The same call makes the same mail at any time, but for its date; its Message-ID is made of the
/// call id. The error is the answer to a request that makes no mail.
tl::expected<Mail, sdk::Response> compose(const Config& config, const CallInfo& call,
                                          fabric::Time now);

/// The mail of a rule's occasion; `id` is the occasion's.
Mail compose(const Config& config, const Rule& rule, const Values& values, fabric::CallId id,
             fabric::Time now);

/// The keys that every template may use because the call brings them: "call.machine" …
const std::set<std::string>& call_keys();

}  // namespace millrace::services::mail
