// Runs one program to its end: no shell, nothing inherited, a session of its own.
//
//   Ended ended = run({.program = "/opt/cell/measure", .arguments = {"WELLE7"}, .input =
//   "WELLE7\n"},
//                     {.time_limit = 5s});
//
// The program's end is the end of its main process. What that leaves running in its session is
// ended with it, in whatever process group; only a process that opened a session of its own
// (setsid) stays.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace millrace::services::batch {

struct Command {
  /// Absolute; executed as it is. A file without "#!" that is no program does not start.
  std::filesystem::path program;
  std::vector<std::string> arguments{};
  /// "NAME=value", besides the few that are passed on of this process's own.
  std::vector<std::string> environment{};
  /// Where it runs; absolute.
  std::filesystem::path folder{};
  /// Its standard input, at most 4096 bytes (they must fit a pipe).
  std::string input{};
};

struct Limits {
  std::chrono::milliseconds time_limit{30000};
  /// From SIGTERM to SIGKILL, once the time is over or nobody wants it any more.
  std::chrono::milliseconds kill_after{1000};
  /// Bytes of standard output to keep; the rest is read and counted.
  std::size_t max_output = 4096;
  /// The same for standard error.
  std::size_t max_errors = 4096;
};

enum class End : std::uint8_t { exited, signalled, time_limit, unwanted, not_started };

/// What a stream brought: the first bytes, and how many there were.
struct Captured {
  std::string text{};
  std::size_t size = 0;
};

struct Ended {
  End end = End::not_started;
  /// Exit code of `exited`, signal number of `signalled`, else 0.
  int code = 0;
  Captured output{};
  Captured errors{};
  /// Why it did not start, in words.
  std::string reason{};
};

/// True once nobody waits for the program's answer any more. Asked from time to time.
using Unwanted = std::function<bool()>;

/// Blocks until the program is over; one that nobody wants any more is ended before its time.
Ended run(
    const Command& command, const Limits& limits, const Unwanted& unwanted = [] { return false; });

}  // namespace millrace::services::batch
