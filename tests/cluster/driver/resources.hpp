// The resources of a process, from /proc.
#pragma once

#include <cstddef>

#include <sys/types.h>

namespace millrace::tests::cluster {

struct Resources {
  /// Resident memory.
  std::size_t bytes = 0;
  std::size_t threads = 0;
  std::size_t descriptors = 0;
};

/// Throws std::runtime_error if there is no such process.
Resources resources_of(pid_t process);

}  // namespace millrace::tests::cluster
