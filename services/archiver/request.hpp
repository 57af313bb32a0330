// What a program may give to the archive: pairs, or a line of text.
//
//   parse("PUT part=WELLE7 d=\"12.345 mm\"")   // two fields
//   parse("tool 5 changed by hand")             // text
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

namespace millrace::services::archiver {

struct Field {
  std::string key;
  std::string value;
  bool operator==(const Field&) const = default;
};

/// "PUT key=value …" has fields, everything else that is not blank is text. Keys are letters,
/// digits,
/// '_' and '-', at most 32, and different. A value ends at a blank, or is in double quotes and then
/// has a quote in it as two ("" for "). The error says what was expected and where.
tl::expected<std::vector<Field>, std::string> parse(std::string_view request);

}  // namespace millrace::services::archiver
