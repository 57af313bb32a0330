// Input without echo: passwords.
#pragma once

#include <string>

namespace millrace::tools::commands {

/// Reads a line of standard input. A terminal shows "PROMPT: " and no echo.
std::string read_hidden(const std::string& prompt);

}  // namespace millrace::tools::commands
