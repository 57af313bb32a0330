// Input without echo: passwords.
#pragma once

#include <string>

namespace millrace::tools::commands {

/// A line of standard input. A terminal shows "PROMPT: " and nothing of what is typed.
std::string read_hidden(const std::string& prompt);

}  // namespace millrace::tools::commands
