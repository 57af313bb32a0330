// Makes the mail that a call requests. Pure.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "services/mail/config.hpp"
#include "services/mail/mail.hpp"
#include "services/mail/template.hpp"
#include "services/sdk/response.hpp"

namespace millrace::services::mail {

/// The same call always makes the same mail, except for its date; its Message-ID is made of the
/// call id. The error is the response to an invalid request.
tl::expected<Mail, sdk::Response> compose(const Config& config, const fabric::Request& call,
                                          fabric::Time now);

/// The mail for an occasion of a rule; `id` is that of the occasion.
Mail compose(const Config& config, const Rule& rule, const Values& values, fabric::CallId id,
             fabric::Time now);

/// "2026-03-01 07:00:00 UTC"
std::string utc(fabric::Time time);

/// The keys that every template may use because the call has their values: "call.machine" …
const std::set<std::string>& call_keys();

// The requests of NC programs to the mail service. Pure.
//
//   parse("done program=WELLE7 parts=12")     // template done, two values
//   parse("alarm to=shift2 text=\"no oil\"")  // for recipients other than the template's

struct Request {
  std::string template_name;
  /// Names after to=, separated by commas; empty = the template's.
  std::vector<std::string> to;
  /// UTF-8.
  Values values;
  bool operator==(const Request&) const = default;
};

/// `request` is CP1252: the name of a template, then fields (services/text/fields.hpp). Unprintable
/// bytes, including line ends, are refused. The error contains what was expected and where.
tl::expected<Request, std::string> parse(std::string_view request);

}  // namespace millrace::services::mail
