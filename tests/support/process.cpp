#include "tests/support/process.hpp"

#include <array>
#include <cassert>
#include <cerrno>
#include <condition_variable>
#include <csignal>
#include <exception>
#include <iostream>
#include <mutex>
#include <optional>
#include <regex>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/posix/system.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tests {

namespace {

using base::posix::Fd;

[[noreturn]] void throw_errno(const std::string& what) {
  throw std::system_error(errno, std::generic_category(), what);
}

struct Pipe {
  Fd read;
  Fd write;
};

Pipe make_pipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw_errno("pipe");
  }
  return {Fd(ends[0]), Fd(ends[1])};
}

/// Runs between fork and exec, so it makes only calls that are safe there. Never returns.
[[noreturn]] void become(const std::vector<char*>& arguments, const std::vector<char*>& environment,
                         pid_t parent, int out, int error) {
  constexpr int cannot_execute = 127;  // as in a shell
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) {
    ::_exit(cannot_execute);
  }
  const int nothing = ::open("/dev/null", O_RDONLY);
  ::dup2(nothing, STDIN_FILENO);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(error, STDERR_FILENO);
  // Cyclone's sockets outlive exec(): a child would keep the ports of its test's domain.
  ::close_range(STDERR_FILENO + 1, ~0U, 0);
  ::execve(arguments.front(), arguments.data(), environment.data());
  ::_exit(cannot_execute);
}

}  // namespace

struct Process::Impl {
  /// Its XDG_STATE_HOME, where a gateway has its journal.
  const std::unique_ptr<TemporaryFolder> state;
  /// The id of a child that this object has forked; with any other, kill() would hit strangers.
  const pid_t pid;
  const std::string command;
  Fd pidfd;
  std::optional<int> exit_code;

  mutable std::mutex mutex;
  std::condition_variable changed;
  std::string out;
  std::string error;
  bool closed = false;
  std::thread reader;

  Impl(pid_t child, std::string command_line, Fd out_end, Fd error_end,
       std::unique_ptr<TemporaryFolder> state_home)
      : state(std::move(state_home)),
        pid(child),
        command(std::move(command_line)),
        pidfd(static_cast<int>(::syscall(SYS_pidfd_open, child, 0))) {
    assert(child > 0);
    reader =
        std::thread([this, first = std::move(out_end), second = std::move(error_end)]() mutable {
          collect(std::move(first), std::move(second));
        });
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (!exit_code) {
      ::kill(pid, SIGKILL);
      reap();
    }
    reader.join();
    if (std::uncaught_exceptions() > 0) {
      tell();
    }
  }

  /// The test fails, and the reason may be in the output of another process.
  void tell() const {
    constexpr std::size_t most = 8192;
    const auto end_of = [](const std::string& text) {
      return text.size() <= most ? text : "[...]" + text.substr(text.size() - most);
    };
    std::cerr << "=== " << command << " wrote until then\n"
              << end_of(out) << "--- standard error\n"
              << end_of(error) << std::flush;
  }

  void reap() {
    int status = 0;
    while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
    }
    exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  /// Waits up to `timeout`; true once the process has ended.
  bool ended(std::chrono::milliseconds timeout) {
    if (!exit_code) {
      pollfd wanted{pidfd.get(), POLLIN, 0};
      if (::poll(&wanted, 1, static_cast<int>(timeout.count())) > 0) {
        reap();
      }
    }
    return exit_code.has_value();
  }

  /// Collects both streams until both are closed, so that the process never blocks on a full pipe.
  void collect(Fd out_end, Fd error_end) {
    std::array<pollfd, 2> ends{{{out_end.get(), POLLIN, 0}, {error_end.get(), POLLIN, 0}}};
    const std::array<std::string*, 2> texts{&out, &error};
    while (ends[0].fd >= 0 || ends[1].fd >= 0) {
      ::poll(ends.data(), ends.size(), -1);
      for (std::size_t i = 0; i < ends.size(); ++i) {
        if (ends.at(i).fd >= 0 && ends.at(i).revents != 0) {
          take(ends.at(i), *texts.at(i));
        }
      }
    }
    const std::lock_guard lock(mutex);
    closed = true;
    changed.notify_all();
  }

  void take(pollfd& end, std::string& text) {
    std::array<char, 4096> buffer{};
    const ssize_t count = ::read(end.fd, buffer.data(), buffer.size());
    if (count <= 0) {
      end.fd = -1;  // poll skips it
      return;
    }
    const std::lock_guard lock(mutex);
    text.append(buffer.data(), static_cast<std::size_t>(count));
    changed.notify_all();
  }

  std::runtime_error failure(const std::string& what) const {
    return std::runtime_error(what + "\n--- standard output\n" + out + "--- standard error\n" +
                              error);
  }

  std::vector<std::string> await(const std::string& text, const std::string& pattern,
                                 std::chrono::milliseconds timeout) {
    const std::regex expression(pattern, std::regex::ECMAScript | std::regex::multiline);
    const auto deadline = std::chrono::steady_clock::now() + timeout;
    std::unique_lock lock(mutex);
    while (true) {
      // Whole lines only: a line that is still being written could match too early.
      const std::string lines = text.substr(0, text.rfind('\n') + 1);
      std::smatch match;
      if (std::regex_search(lines, match, expression)) {
        return {match.begin(), match.end()};
      }
      if (closed) {
        throw failure("the process ended before it wrote: " + pattern);
      }
      if (changed.wait_until(lock, deadline) == std::cv_status::timeout) {
        throw failure("the process did not write in time: " + pattern);
      }
    }
  }
};

std::string binary(std::string_view name) {
  return std::string(MILLRACE_BIN) + '/' + std::string(name);
}

Process::Process(std::vector<std::string> command, const std::filesystem::path& state_home) {
  if (::access(command.at(0).c_str(), X_OK) != 0) {
    throw_errno("cannot execute " + command.at(0));
  }
  std::string line;
  std::vector<char*> arguments;
  for (std::string& argument : command) {
    line += (line.empty() ? "" : " ") + argument;
    arguments.push_back(argument.data());
  }
  arguments.push_back(nullptr);
  auto state = std::make_unique<TemporaryFolder>();
  std::string home = "XDG_STATE_HOME=" + (state_home.empty() ? state->path() : state_home).string();
  std::vector<char*> environment{home.data()};
  for (char** variable = ::environ; *variable != nullptr; ++variable) {
    if (!std::string_view(*variable).starts_with("XDG_STATE_HOME=")) {
      environment.push_back(*variable);
    }
  }
  environment.push_back(nullptr);
  Pipe out = make_pipe();
  Pipe error = make_pipe();
  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid < 0) {
    throw_errno("fork");
  }
  if (pid == 0) {
    become(arguments, environment, parent, out.write.get(), error.write.get());
  }
  impl_ = std::make_unique<Impl>(pid, std::move(line), std::move(out.read), std::move(error.read),
                                 std::move(state));
}

Process::~Process() = default;
Process::Process(Process&&) noexcept = default;
Process& Process::operator=(Process&&) noexcept = default;

pid_t Process::pid() const {
  return impl_->pid;
}

std::vector<std::string> Process::await(const std::string& pattern,
                                        std::chrono::milliseconds timeout) {
  return impl_->await(impl_->out, pattern, timeout);
}

std::vector<std::string> Process::await_error(const std::string& pattern,
                                              std::chrono::milliseconds timeout) {
  return impl_->await(impl_->error, pattern, timeout);
}

void Process::signal(int number) {
  if (!impl_->exit_code) {
    ::kill(impl_->pid, number);
  }
}

void Process::terminate() {
  signal(SIGTERM);
}

void Process::kill() {
  signal(SIGKILL);
  wait();
}

int Process::wait(std::chrono::milliseconds timeout) {
  const bool ended = impl_->ended(timeout);
  std::unique_lock lock(impl_->mutex);
  if (!ended) {
    throw impl_->failure("the process did not end in time");
  }
  if (!impl_->changed.wait_for(lock, timeout, [&] { return impl_->closed; })) {
    throw impl_->failure("the process ended, but a child of its own still holds its output");
  }
  return *impl_->exit_code;
}

bool Process::running() {
  return !impl_->ended(std::chrono::milliseconds(0));
}

std::string Process::output() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->out;
}

std::string Process::error_output() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->error;
}

}  // namespace millrace::tests
