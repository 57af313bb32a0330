// Texts of the CNC for a terminal: CP1252 in, UTF-8 out.
#pragma once

#include <string>
#include <string_view>

namespace millrace::cnc::simulator {

/// The five bytes that CP1252 leaves undefined become U+FFFD.
std::string utf8_of_cp1252(std::string_view text);

}  // namespace millrace::cnc::simulator
