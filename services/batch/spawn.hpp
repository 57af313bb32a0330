// Starting a process: pipes for its three streams, nothing else inherited.
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
  /// Becomes readable when it has ended (pidfd).
  base::posix::Fd ended;
  /// The end of its standard output and error to read from; non-blocking.
  base::posix::Fd output;
  base::posix::Fd errors;
};

/// Starts `command`; its input is already written and closed when this returns. The error says what
/// could not be done and why.
tl::expected<Child, std::string> spawn(const Command& command);

}  // namespace millrace::services::batch
