#include "tools/commands/hidden_input.hpp"

#include <iostream>

#include <fmt/format.h>
#include <termios.h>
#include <unistd.h>

namespace millrace::tools::commands {

namespace {

/// Switches the echo of a terminal off while it lives.
class Unseen {
 public:
  explicit Unseen(const std::string& prompt) {
    if (::tcgetattr(STDIN_FILENO, &before_) == 0) {
      is_terminal_ = true;
      termios unseen = before_;
      unseen.c_lflag &= ~static_cast<tcflag_t>(ECHO);
      ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &unseen);
      fmt::print(stderr, "{}: ", prompt);
    }
  }
  ~Unseen() {
    if (is_terminal_) {
      ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &before_);
      fmt::print(stderr, "\n");
    }
  }
  Unseen(const Unseen&) = delete;
  Unseen& operator=(const Unseen&) = delete;

 private:
  bool is_terminal_ = false;
  termios before_{};
};

}  // namespace

std::string read_hidden(const std::string& prompt) {
  const Unseen unseen(prompt);
  std::string line;
  std::getline(std::cin, line);
  return line;
}

}  // namespace millrace::tools::commands
