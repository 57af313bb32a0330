#include "tests/support/terminal.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <stdexcept>
#include <system_error>

#include <poll.h>
#include <pty.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace millrace::tests {

namespace {

using Clock = std::chrono::steady_clock;

std::chrono::milliseconds until(Clock::time_point end) {
  return std::max(std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now()),
                  std::chrono::milliseconds(0));
}

}  // namespace

std::string Terminal::obstacle() {
  int ends[2] = {-1, -1};
  if (::openpty(&ends[0], &ends[1], nullptr, nullptr, nullptr) != 0) {
    return std::string("no terminal can be had here: ") + std::generic_category().message(errno);
  }
  ::close(ends[0]);
  ::close(ends[1]);
  return {};
}

Terminal::Terminal(const std::vector<std::string>& command, Size size) {
  std::vector<char*> arguments;
  for (const std::string& word : command) {
    arguments.push_back(const_cast<char*>(word.c_str()));
  }
  arguments.push_back(nullptr);
  winsize window{};
  window.ws_row = size.rows;
  window.ws_col = size.columns;
  pid_ = ::forkpty(&terminal_, nullptr, nullptr, &window);
  if (pid_ < 0) {
    throw std::system_error(errno, std::generic_category(), "forkpty");
  }
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::close_range(STDERR_FILENO + 1, ~0U, 0);  // as in process.cpp
    ::execv(arguments.front(), arguments.data());
    ::_exit(127);
  }
}

Terminal::~Terminal() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  ::close(terminal_);
}

bool Terminal::read_some(std::chrono::milliseconds timeout) {
  pollfd wanted{terminal_, POLLIN, 0};
  if (::poll(&wanted, 1, static_cast<int>(timeout.count())) <= 0) {
    return true;
  }
  std::array<char, 4096> buffer{};
  // Once the last program of a terminal has ended, reading it fails with EIO.
  const ssize_t size = ::read(terminal_, buffer.data(), buffer.size());
  if (size <= 0) {
    return false;
  }
  output_.append(buffer.data(), static_cast<std::size_t>(size));
  return true;
}

void Terminal::await(const std::string& text, std::chrono::milliseconds timeout) {
  const auto end = Clock::now() + timeout;
  while (output_.find(text) == std::string::npos) {
    if (!read_some(until(end)) || Clock::now() >= end) {
      throw std::runtime_error("'" + text + "' did not come; the terminal shows:\n" + output_);
    }
  }
}

void Terminal::type(const std::string& keys) {
  if (::write(terminal_, keys.data(), keys.size()) != static_cast<ssize_t>(keys.size())) {
    throw std::system_error(errno, std::generic_category(), "write to a terminal");
  }
}

int Terminal::wait(std::chrono::milliseconds timeout) {
  const auto end = Clock::now() + timeout;
  while (read_some(until(end))) {
    if (Clock::now() >= end) {
      throw std::runtime_error("the program did not end; the terminal shows:\n" + output_);
    }
  }
  int status = 0;
  ::waitpid(pid_, &status, 0);
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace millrace::tests
