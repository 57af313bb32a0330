// millrace-batch --exec: one program, all on the command line.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace millrace::services::batch {

/// The command line of every service, and --exec PROGRAM, --time-limit MS, --accept-empty, --cut
/// and --cp1252. Returns an exit code.
int serve_one(int argc, char** argv);

/// A line for each flag of it that `others` does not have, for their help and man page.
std::string flags_of_one(const CLI::App& others);

}  // namespace millrace::services::batch
