// The processes of a session, in any process group.
#pragma once

#include <vector>

#include <sys/types.h>

namespace millrace::services::batch {

/// The running processes, without zombies. The session keeps its number until its leader is reaped.
std::vector<pid_t> processes_of(pid_t session);

/// Sends `signal` to all of them.
void signal_session(pid_t session, int signal);

/// Ends all of them (SIGKILL), also those that start during this call.
void kill_session(pid_t session);

}  // namespace millrace::services::batch
