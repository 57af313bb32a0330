// Runs one process to its end: no shell, no inherited descriptors, its own session.
//
//   Ended ended = run(
//       {.program = "/opt/cell/measure", .arguments = {"WELLE7"}, .input = "WELLE7\n"},
//       {.time_limit = 5s});
//
// The end is that of the main process. All processes that it leaves are ended with it, in any
// process group and session; only a process that outlive() has started stays.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <sys/types.h>
#include <tl/expected.hpp>

namespace millrace::services::batch {

struct Command {
  /// Absolute; executed directly. A file that is neither a binary nor begins with "#!" does not
  /// start.
  std::filesystem::path program;
  std::vector<std::string> arguments{};
  /// "NAME=value", in addition to the few variables passed on from this process.
  std::vector<std::string> environment{};
  /// Working directory; absolute.
  std::filesystem::path folder{};
  /// Its standard input, at most 4096 bytes (they must fit into a pipe).
  std::string input{};
};

struct Limits {
  std::chrono::milliseconds time_limit{30000};
  /// Time from SIGTERM to SIGKILL, after the time limit or a cancellation.
  std::chrono::milliseconds kill_after{1000};
  /// Bytes of standard output to keep; the rest is read and counted.
  std::size_t max_output = 4096;
  /// The same for standard error.
  std::size_t max_errors = 4096;
};

enum class End : std::uint8_t { exited, signalled, time_limit, unwanted, not_started };

/// The first bytes of a stream, and the number of all its bytes.
struct Captured {
  std::string text{};
  std::size_t size = 0;
};

struct Ended {
  End end = End::not_started;
  /// Exit code of `exited`, signal number of `signalled`, otherwise 0.
  int code = 0;
  Captured output{};
  Captured errors{};
  /// Why the process did not start, as text.
  std::string reason{};
};

/// True once no call waits for the result. Called periodically.
using Unwanted = std::function<bool()>;

/// Blocks until the process has ended; ends it early once `unwanted` returns true.
Ended run(
    const Command& command, const Limits& limits, const Unwanted& unwanted = [] { return false; });

/// Starts a program (found in PATH) in a session of its own that outlives the run from which this
/// is called, once this has returned. Streams of the run become /dev/null. The error is the reason
/// why it did not start.
tl::expected<pid_t, std::string> outlive(std::vector<std::string> arguments);

}  // namespace millrace::services::batch
