// Similarity of two texts.
#pragma once

#include <cstddef>
#include <string_view>

namespace millrace::base::text {

/// Levenshtein distance: the number of inserted, removed and replaced bytes.
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace millrace::base::text
