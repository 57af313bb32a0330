// A program under test as a real process: the test starts it, reads its output and ends it by its
// process id.
//
//   Process cnc({binary("millrace-cnc"), "--listen", "127.0.0.1:0"});
//   const std::string port = cnc.await("^ready: .* on 127\\.0\\.0\\.1:(\\d+)").at(1);
//   …
//   cnc.terminate();
//   EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
//
// The process ends with the test in any case. Its XDG_STATE_HOME is a folder of its own, deleted
// with it, unless the test names one. If a test fails by an exception, each of its processes shows
// its output.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

namespace millrace::tests {

/// Longer than any healthy program needs on a busy machine; a test fails when it is over.
inline constexpr std::chrono::seconds patience{30};

/// The path of a program of this build.
std::string binary(std::string_view name);

/// Not copyable; each object is one process. Its standard input is empty.
class Process {
 public:
  /// Starts `command`, the first element being the path of the program. `state_home` is its
  /// XDG_STATE_HOME, for one that continues what an earlier process kept.
  /// @throws std::system_error if it cannot be started
  explicit Process(std::vector<std::string> command, const std::filesystem::path& state_home = {});
  /// Kills the process if it still runs.
  ~Process();
  Process(Process&&) noexcept;
  Process& operator=(Process&&) noexcept;

  [[nodiscard]] pid_t pid() const;

  /// Waits for a line of standard output in which `pattern` (ECMAScript) is found, and returns the
  /// whole match and its groups. Lines already there count.
  /// @throws std::runtime_error with all output if the process ends or the time is up before
  std::vector<std::string> await(const std::string& pattern,
                                 std::chrono::milliseconds timeout = patience);
  /// The same for standard error.
  std::vector<std::string> await_error(const std::string& pattern,
                                       std::chrono::milliseconds timeout = patience);

  /// Sends a signal; does nothing if the process has been waited for.
  void signal(int number);
  /// Asks it to end (SIGTERM).
  void terminate();
  /// Kills it (SIGKILL), like a crash, and waits.
  void kill();

  /// Waits for the end: its exit code, or 128 + the signal that killed it.
  /// @throws std::runtime_error with all output if the time is up before
  int wait(std::chrono::milliseconds timeout = patience);
  /// False once it has ended.
  [[nodiscard]] bool running();

  /// The output so far; complete once wait() has returned.
  [[nodiscard]] std::string output() const;
  [[nodiscard]] std::string error_output() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::tests
