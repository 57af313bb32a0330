// Starts a process: pipes for its three streams, nothing else inherited.
#pragma once

#include <string>

#include <sys/types.h>
#include <tl/expected.hpp>

#include "base/posix/fd.hpp"
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

}  // namespace millrace::services::batch
