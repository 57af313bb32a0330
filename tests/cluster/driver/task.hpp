// A program that runs on a host of the cluster.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include <sys/types.h>

#include "tests/support/process.hpp"

namespace millrace::tests::cluster {

/// Ends with its object, whatever happens to the test.
class Task {
 public:
  Task() = default;
  virtual ~Task() = default;
  Task(const Task&) = delete;
  Task& operator=(const Task&) = delete;

  /// Waits for a line of standard output in which `pattern` (ECMAScript) is found: the whole match
  /// and its groups. Throws std::runtime_error with all output if the program ends or the time is
  /// up before.
  virtual std::vector<std::string> await(const std::string& pattern,
                                         std::chrono::milliseconds timeout = patience) = 0;
  /// The same for the log.
  virtual std::vector<std::string> await_log(const std::string& pattern,
                                             std::chrono::milliseconds timeout = patience) = 0;
  /// Standard output so far.
  [[nodiscard]] virtual std::string output() const = 0;
  /// Standard error so far.
  [[nodiscard]] virtual std::string log() const = 0;

  /// As a crash does (SIGKILL).
  virtual void kill() = 0;
  /// As an operator does (SIGTERM).
  virtual void terminate() = 0;
  /// Freezes the program until resume().
  virtual void pause() = 0;
  virtual void resume() = 0;

  /// The id of the program's process, as this process sees it; it must run.
  [[nodiscard]] virtual pid_t pid() const = 0;

  /// Waits for the end: the exit code, or 128 + the signal.
  virtual int wait(std::chrono::milliseconds timeout = patience) = 0;
};

}  // namespace millrace::tests::cluster
