// A program that runs on a host of the cluster: a process of this machine whose output and exit
// code are the program's.
#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include <sys/types.h>

#include "tests/support/process.hpp"

namespace millrace::tests::cluster {

/// Ends with its object in any case. A back end overrides functions where the process only
/// represents the program.
class Task {
 public:
  explicit Task(std::vector<std::string> command) : process_(std::move(command)) {}
  virtual ~Task() = default;
  Task(const Task&) = delete;
  Task& operator=(const Task&) = delete;

  /// Waits for a line of standard output in which `pattern` (ECMAScript) is found; returns the
  /// whole match and its groups. Throws std::runtime_error with all output if the program ends or
  /// the time is up before.
  std::vector<std::string> await(const std::string& pattern,
                                 std::chrono::milliseconds timeout = patience) {
    return process_.await(pattern, timeout);
  }
  /// The same for the log.
  std::vector<std::string> await_log(const std::string& pattern,
                                     std::chrono::milliseconds timeout = patience) {
    return process_.await_error(pattern, timeout);
  }
  /// Standard output so far.
  [[nodiscard]] std::string output() const { return process_.output(); }
  /// Standard error so far.
  [[nodiscard]] std::string log() const { return process_.error_output(); }

  /// Like a crash (SIGKILL).
  virtual void kill() { process_.kill(); }
  /// Like an operator (SIGTERM).
  virtual void terminate() { process_.terminate(); }

  /// The id of the program's process, as this process sees it; the program must run.
  [[nodiscard]] virtual pid_t pid() const { return process_.pid(); }

  /// Waits for the end: the exit code, or 128 + the signal.
  int wait(std::chrono::milliseconds timeout = patience) { return process_.wait(timeout); }

 private:
  Process process_;
};

}  // namespace millrace::tests::cluster
