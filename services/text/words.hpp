// Splits requests into words, independent of the locale.
//
//   words("  READ  depth ") == {"READ", "depth"}
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace millrace::services::text {

/// The parts of `text` between blanks and tabs; views into it.
std::vector<std::string_view> words(std::string_view text);

/// ASCII letters only.
std::string upper_case(std::string_view text);

/// An ASCII letter or digit, '_' or '-'.
bool is_name_character(char c);

}  // namespace millrace::services::text
