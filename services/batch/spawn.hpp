// Starts a process: pipes for its three streams, nothing else inherited.
#pragma once

#include <string>
#include <vector>

#include <sys/types.h>
#include <tl/expected.hpp>

#include "base/posix/system.hpp"
#include "services/batch/process.hpp"

namespace millrace::services::batch {

/// A started process, leader of its own session. The caller must reap it.
struct Child {
  pid_t pid = -1;
  /// Becomes readable when the process has ended (pidfd).
  base::posix::Fd ended;
  /// The read ends of its standard output and error; non-blocking.
  base::posix::Fd output;
  base::posix::Fd errors;
};

/// Starts `command`; its input is already written and closed when this returns. The error contains
/// the failed step and the reason.
tl::expected<Child, std::string> spawn(const Command& command);

// The processes of a session, in any process group.

/// The running processes, without zombies. The session keeps its number until its leader is reaped.
std::vector<pid_t> processes_of(pid_t session);

/// Sends `signal` to all of them.
void signal_session(pid_t session, int signal);

/// Ends all of them (SIGKILL), also those that start during this call.
void kill_session(pid_t session);

}  // namespace millrace::services::batch
