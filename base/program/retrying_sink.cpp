#include "base/program/retrying_sink.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <system_error>

#include <poll.h>
#include <spdlog/pattern_formatter.h>
#include <unistd.h>

namespace millrace::base::program {

namespace {

/// A writable pipe accepts this much without blocking (PIPE_BUF is 4096).
constexpr std::size_t piece = 4096;
constexpr std::chrono::milliseconds look_again{50};
constexpr std::chrono::seconds patience_at_the_end{1};

/// A broken descriptor counts as ready: the write reports the error.
bool takes(int fd, std::chrono::milliseconds limit) {
  pollfd wanted{.fd = fd, .events = POLLOUT, .revents = 0};
  return ::poll(&wanted, 1, static_cast<int>(limit.count())) > 0;
}

/// The number of bytes written; all of them if the descriptor has no reader left.
std::size_t write_piece(int fd, std::string_view text) {
  const ssize_t written = ::write(fd, text.data(), std::min(text.size(), piece));
  if (written >= 0) {
    return static_cast<std::size_t>(written);
  }
  return errno == EINTR || errno == EAGAIN ? 0 : text.size();
}

}  // namespace

RetryingSink::RetryingSink(int fd, std::size_t room) : fd_(fd), room_(room) {}

RetryingSink::~RetryingSink() {
  {
    const Lock lock(lock_);
    ending_ = true;
  }
  if (writer_.joinable()) {
    writer_.join();
  }
}

void RetryingSink::sink_it_(const spdlog::details::log_msg& message) {
  spdlog::memory_buf_t line;
  formatter_->format(message, line);
  std::string_view text(line.data(), line.size());
  const Lock lock(lock_);
  if (!writing_ && kept_.empty()) {
    text = write_now(text);
  }
  if (!text.empty()) {
    keep(text);
  }
}

std::string_view RetryingSink::write_now(std::string_view text) const {
  while (!text.empty() && takes(fd_, std::chrono::milliseconds(0))) {
    const std::size_t written = write_piece(fd_, text);
    if (written == 0) {
      break;
    }
    text.remove_prefix(written);
  }
  return text;
}

void RetryingSink::keep(std::string_view text) {
  if (size_ + text.size() > room_) {
    ++dropped_;
    return;
  }
  report_dropped();
  kept_.emplace_back(text);
  size_ += text.size();
  start_writer();
}

/// Adds the line about dropped lines at their place.
void RetryingSink::report_dropped() {
  if (dropped_ > 0) {
    kept_.push_back(std::to_string(dropped_) +
                    " log lines are missing here: standard error was not read in time\n");
    size_ += kept_.back().size();
    dropped_ = 0;
  }
}

void RetryingSink::start_writer() {
  if (writing_) {
    return;
  }
  if (writer_.joinable()) {
    // It has ended already, or is about to without needing the lock.
    writer_.join();
  }
  try {
    writer_ = std::thread([this] { write_kept(); });
    writing_ = true;
  } catch (const std::system_error&) {
    // No thread could be started: the next line tries again.
  }
}

void RetryingSink::write_kept() {
  Lock lock(lock_);
  auto end = std::chrono::steady_clock::time_point::max();
  while (!kept_.empty() && std::chrono::steady_clock::now() < end) {
    std::string_view text = kept_.front();
    lock.unlock();
    // The deque keeps its first line in place while others are appended.
    const bool taken = takes(fd_, look_again);
    const std::size_t written = taken ? write_piece(fd_, text) : 0;
    lock.lock();
    if (ending_ && end == std::chrono::steady_clock::time_point::max()) {
      end = std::chrono::steady_clock::now() + patience_at_the_end;
    }
    size_ -= written;
    if (written == text.size()) {
      kept_.pop_front();
    } else {
      kept_.front().erase(0, written);
    }
    if (kept_.empty()) {
      report_dropped();
    }
  }
  writing_ = false;
}

}  // namespace millrace::base::program
