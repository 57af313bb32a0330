// key=value pairs, the form in which programs hand over named values.
//
//   fields("part=WELLE7 d=\"12.345 mm\"").value() == {{"part", "WELLE7"}, {"d", "12.345 mm"}}
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

namespace millrace::services::text {

struct Field {
  std::string key;
  std::string value;
  bool operator==(const Field&) const = default;
};

/// The pairs of `text` with blanks or tabs between them; none if it is blank. Keys are letters,
/// digits, '_' and '-', at most 32, and different. A value ends at a blank, or is in double quotes
/// and then has a quote in it as two ("" for "). The error says what was expected and where.
tl::expected<std::vector<Field>, std::string> fields(std::string_view text);

/// Letters, digits, '_' and '-', 1 to 32: the form of a key, and of other names in requests.
bool is_name(std::string_view name);

}  // namespace millrace::services::text
