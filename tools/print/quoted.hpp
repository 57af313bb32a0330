// Texts of the controller for a terminal.
#pragma once

#include <string>
#include <string_view>

namespace millrace::tools::print {

/// CP1252 bytes in quotes, as UTF-8; what is not printable becomes \xNN, so that nothing that came
/// from a machine can control the terminal.
std::string quoted(std::string_view cp1252);

/// The same without quotes, for texts of the fabric that are UTF-8 by convention but may hold
/// anything.
std::string safe(std::string_view utf8);

}  // namespace millrace::tools::print
