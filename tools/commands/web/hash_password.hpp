// `millrace web --hash-password`.
#pragma once

namespace millrace::tools::commands::web {

/// Reads a line from standard input, without echo on a terminal, and prints its hash; returns the
/// exit code.
int print_hash();

}  // namespace millrace::tools::commands::web
