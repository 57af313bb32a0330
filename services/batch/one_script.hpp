// millrace-batch --exec: one program, all on the command line.
#pragma once

namespace millrace::services::batch {

/// The command line of every service, and --exec PROGRAM, --time-limit MS, --accept-empty, --cut
/// and
/// --cp1252. Returns an exit code.
int serve_one(int argc, char** argv);

}  // namespace millrace::services::batch
