// What a program may ask of the mail service. Pure.
//
//   parse("done program=WELLE7 parts=12")     // template done, two values
//   parse("alarm to=shift2 text=\"no oil\"")  // for other recipients than the template's
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "services/mail/template.hpp"

namespace millrace::services::mail {

struct Request {
  std::string template_name;
  /// Names behind to=, which may be several with commas between them; empty = the template's.
  std::vector<std::string> to;
  /// UTF-8.
  Values values;
  bool operator==(const Request&) const = default;
};

/// `request` is CP1252: the name of a template, then fields (services/text/fields.hpp). Bytes that
/// do not print, line ends among them, are refused. The error says what was expected and where.
tl::expected<Request, std::string> parse(std::string_view request);

}  // namespace millrace::services::mail
