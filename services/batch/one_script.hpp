// millrace-batch --exec: one script, configured on the command line.
#pragma once

namespace CLI {
class App;
}

namespace millrace::services::batch {

/// The command line of every service, and --exec PROGRAM, --time-limit MS, --accept-empty, --cut
/// and --cp1252. Returns an exit code.
int serve_one(int argc, char** argv);

/// Adds those of its flags that `others` does not have, for their help, man page and completion. A
/// command line with one of them and without --exec is refused.
void tell_flags_of_one(CLI::App& others);

}  // namespace millrace::services::batch
