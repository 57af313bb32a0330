// The requests of NC programs to the mail service. Pure.
//
//   parse("done program=WELLE7 parts=12")     // template done, two values
//   parse("alarm to=shift2 text=\"no oil\"")  // for recipients other than the template's
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "services/mail/template.hpp"

namespace millrace::services::mail {

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
