#include "tools/commands/web/hash_password.hpp"

#include <iostream>
#include <string>

#include <fmt/format.h>
#include <termios.h>
#include <unistd.h>

#include "base/program/command_line.hpp"
#include "tools/web/gate/users.hpp"

namespace millrace::tools::commands::web {

namespace {

/// A terminal shows nothing of what is typed as long as it lives.
class Unseen {
 public:
  Unseen() {
    if (::tcgetattr(STDIN_FILENO, &before_) == 0) {
      is_terminal_ = true;
      termios unseen = before_;
      unseen.c_lflag &= ~static_cast<tcflag_t>(ECHO);
      ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &unseen);
      fmt::print(stderr, "Password: ");
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

int print_hash() {
  std::string password;
  {
    const Unseen unseen;
    std::getline(std::cin, password);
  }
  if (password.empty()) {
    throw base::program::UsageError("--hash-password: expected a password on standard input");
  }
  fmt::print("{}\n", tools::web::gate::hash_of(password));
  return base::program::exit_done;
}

}  // namespace millrace::tools::commands::web
