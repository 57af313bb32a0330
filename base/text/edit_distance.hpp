// How far two texts are apart.
#pragma once

#include <cstddef>
#include <string_view>

namespace millrace::base::text {

/// Insertions, removals and replacements that turn one text into the other (Levenshtein).
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace millrace::base::text
