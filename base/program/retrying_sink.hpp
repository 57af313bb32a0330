// The sink of log lines: a descriptor whose reader may be slow or blocked.
//
// Logging never blocks: a line that the descriptor does not accept at once is kept, and a separate
// thread writes it once the reader continues. So a stopped terminal or a blocked reader of a pipe
// does not stop the threads that receive, respond or supervise. While the descriptor accepts lines,
// they are written before the call returns, and a crash loses none.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include <spdlog/sinks/base_sink.h>

namespace millrace::base::program {

/// Thread-safe.
class RetryingSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  /// `fd` must stay open longer than the sink. At most `room` bytes are kept; further lines are
  /// dropped, and a line at their place has their number.
  explicit RetryingSink(int fd, std::size_t room = std::size_t{1} << 20U);
  /// Waits for the reader to take the kept lines, at most one second.
  ~RetryingSink() override;

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override;
  void flush_() override {}

 private:
  using Lock = std::unique_lock<std::mutex>;

  /// Writes what the descriptor accepts at once; returns the rest of `text`.
  [[nodiscard]] std::string_view write_now(std::string_view text) const;
  void keep(std::string_view text);
  void start_writer();
  void write_kept();
  void report_dropped();

  const int fd_;
  const std::size_t room_;
  // Separate from the mutex of base_sink, which a logging thread holds: this one is never held for
  // long.
  std::mutex lock_;
  std::deque<std::string> kept_;
  std::size_t size_ = 0;
  std::uint64_t dropped_ = 0;
  bool ending_ = false;
  bool writing_ = false;
  std::thread writer_;
};

}  // namespace millrace::base::program
