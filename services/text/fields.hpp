// Parses key=value pairs, with which NC programs send named values.
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

/// The pairs of `text`, separated by blanks or tabs; empty if it is blank. Keys are letters,
/// digits, '_' and '-', at most 32, and distinct. A value ends at a blank, or is in double quotes,
/// in which "" is one quote. The error contains what was expected and where.
tl::expected<std::vector<Field>, std::string> fields(std::string_view text);

/// Letters, digits, '_' and '-', 1 to 32: the form of a key, and of other names in requests.
bool is_name(std::string_view name);

// Splits requests into words, independent of the locale.
//
//   words("  READ  depth ") == {"READ", "depth"}

/// The parts of `text` between blanks and tabs; views into it.
std::vector<std::string_view> words(std::string_view text);

/// ASCII letters only.
std::string upper_case(std::string_view text);

/// An ASCII letter or digit, '_' or '-'.
bool is_name_character(char c);

}  // namespace millrace::services::text
