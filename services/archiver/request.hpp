// The request of an NC program to the archive: pairs, or a line of text.
//
//   parse("PUT part=WELLE7 d=\"12.345 mm\"")   // two fields
//   parse("tool 5 changed by hand")             // text
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "services/text/fields.hpp"

namespace millrace::services::archiver {

using Field = text::Field;

/// "PUT key=value …" has fields (services/text/fields.hpp); any other text that is not blank is
/// text. The error contains what was expected and where.
tl::expected<std::vector<Field>, std::string> parse(std::string_view request);

}  // namespace millrace::services::archiver
