// millrace-batch --exec: one program, all on the command line.
#pragma once

namespace millrace::services::batch {

/// Served under this UUID unless --uuid names another.
inline constexpr const char* default_uuid = "f8346304-c93c-4a7e-9866-aacceffb7e34";

/// The command line of every service, and --exec PROGRAM, --time-limit MS, --accept-empty, --cut
/// and
/// --cp1252. Returns an exit code.
int serve_one(int argc, char** argv);

}  // namespace millrace::services::batch
