// A program under test on a terminal, as a user has it: its screen, and keys.
//
//   Terminal sut({binary("millrace"), "watch"}, {.rows = 24, .columns = 80});
//   sut.await("CHANNEL");
//   sut.type("\x03");                    // Ctrl-C
//   EXPECT_EQ(sut.wait(), 0);
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/support/process.hpp"

namespace millrace::tests {

class Terminal {
 public:
  /// The reason why terminals are unavailable here (for example no /dev/pts); empty if they are.
  static std::string obstacle();

  struct Size {
    unsigned short rows = 24;
    unsigned short columns = 80;
  };
  /// Starts `command` on a new terminal of type xterm. Throws std::system_error.
  explicit Terminal(const std::vector<std::string>& command, Size size);
  Terminal(const std::vector<std::string>& command) : Terminal(command, Size{}) {}
  /// Kills the process if it still runs.
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  /// Waits until `text` has been written since the start. Throws std::runtime_error with all output
  /// if the process ends or the timeout is over before.
  void await(const std::string& text, std::chrono::milliseconds timeout = patience);
  /// Sends keys.
  void type(const std::string& keys);
  /// Waits for the end: its exit code, or 128 + the signal that killed it. Throws
  /// std::runtime_error with all output if the time is up before.
  int wait(std::chrono::milliseconds timeout = patience);
  /// All output so far, control sequences included.
  [[nodiscard]] const std::string& output() const { return output_; }

 private:
  /// Reads what arrives within `timeout`; false if the terminal is closed.
  bool read_some(std::chrono::milliseconds timeout);

  int terminal_ = -1;
  pid_t pid_ = -1;
  std::string output_;
};

}  // namespace millrace::tests
