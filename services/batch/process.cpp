#include "services/batch/process.hpp"

#include <algorithm>
#include <array>
#include <csignal>
#include <optional>

#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include "services/batch/spawn.hpp"

namespace millrace::services::batch {

namespace {

using Clock = std::chrono::steady_clock;
using base::posix::Fd;

/// The longest delay until a cancelled call is noticed.
constexpr std::chrono::milliseconds look_up{50};

/// The most bytes in a pipe, so the most that is left when the process has ended.
constexpr std::size_t pipe_capacity = 1 << 20;

/// Reads the available bytes, at most one full pipe; closes `fd` at its end.
void drain(Fd& fd, Captured& into, std::size_t keep) {
  std::array<char, 4096> bytes{};
  for (std::size_t total = 0; fd && total < pipe_capacity;) {
    const ssize_t count = ::read(fd.get(), bytes.data(), bytes.size());
    if (count < 0) {
      return;  // no bytes available now
    }
    if (count == 0) {
      fd.close();
      return;
    }
    const auto size = static_cast<std::size_t>(count);
    into.text.append(bytes.data(), std::min(size, keep - into.text.size()));
    into.size += size;
    total += size;
  }
}

/// One running process, and the decision when to end it.
class Run {
 public:
  Run(Child child, const Limits& limits, const Unwanted& unwanted)
      : child_(std::move(child)),
        limits_(limits),
        unwanted_(unwanted),
        next_(Clock::now() + limits.time_limit) {}

  Ended finish() {
    while (!wait()) {
    }
    // The zombie keeps its number, so the session is still ours to end.
    kill_session(child_.pid);
    drain(child_.output, ended_.output, limits_.max_output);
    drain(child_.errors, ended_.errors, limits_.max_errors);
    reap();
    return std::move(ended_);
  }

 private:
  enum class Phase : std::uint8_t { running, asked_to_end, killed };

  /// Waits for the next event and handles it; true once the process has ended.
  bool wait() {
    std::array<pollfd, 3> events{pollfd{child_.ended.get(), POLLIN, 0},
                                 pollfd{child_.output.get(), POLLIN, 0},
                                 pollfd{child_.errors.get(), POLLIN, 0}};
    ::poll(events.data(), events.size(), remaining());
    drain(child_.output, ended_.output, limits_.max_output);
    drain(child_.errors, ended_.errors, limits_.max_errors);
    if (events[0].revents != 0) {
      return true;
    }
    if (phase_ == Phase::running && unwanted_()) {
      end_early(End::unwanted);
    } else if (phase_ != Phase::killed && Clock::now() >= next_) {
      end_early(End::time_limit);
    }
    return false;
  }

  /// Milliseconds until the next step of ending it; -1 if only its end is left to wait for.
  [[nodiscard]] int remaining() const {
    if (phase_ == Phase::killed) {
      return -1;
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(next_ - Clock::now()).count();
    return static_cast<int>(std::clamp<std::int64_t>(left, 0, look_up.count()));
  }

  void end_early(End end) {
    if (phase_ == Phase::running) {
      early_ = end;
      phase_ = Phase::asked_to_end;
      next_ = Clock::now() + limits_.kill_after;
      signal_session(child_.pid, SIGTERM);
      // A stopped (SIGSTOP) process could not handle it.
      signal_session(child_.pid, SIGCONT);
    } else {
      phase_ = Phase::killed;
      kill_session(child_.pid);
    }
  }

  void reap() {
    int status = 0;
    ::waitpid(child_.pid, &status, 0);
    if (early_) {
      ended_.end = *early_;
    } else if (WIFSIGNALED(status)) {
      ended_.end = End::signalled;
      ended_.code = WTERMSIG(status);
    } else {
      ended_.end = End::exited;
      ended_.code = WEXITSTATUS(status);
    }
  }

  Child child_;
  Limits limits_;
  const Unwanted& unwanted_;
  Phase phase_ = Phase::running;
  Clock::time_point next_;
  std::optional<End> early_;
  Ended ended_;
};

}  // namespace

Ended run(const Command& command, const Limits& limits, const Unwanted& unwanted) {
  if (unwanted()) {
    return {.end = End::unwanted};
  }
  auto child = spawn(command);
  if (!child) {
    return {.end = End::not_started, .reason = child.error()};
  }
  return Run(std::move(*child), limits, unwanted).finish();
}

}  // namespace millrace::services::batch
