// `millrace web --hash-password`.
#pragma once

namespace millrace::tools::commands::web {

/// Reads a line from standard input, unseen on a terminal, and prints its hash; the exit code.
int print_hash();

}  // namespace millrace::tools::commands::web
