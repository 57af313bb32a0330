// The word for a code of a later version, for those that name codes.
//
//   return index < size ? names.at(index) : unknown_word(index);      // "unknown (200)"
#pragma once

#include <cstdint>
#include <string_view>

namespace millrace::fabric {

/// "unknown (200)"; it lives as long as the process.
std::string_view unknown_word(std::uint8_t number);

}  // namespace millrace::fabric
