// Where log lines go: a descriptor whose reader may be slow, or stand still.
//
// Whoever logs never waits for it: a line that is not taken at once is kept, and written by a
// thread of its own once the reader goes on. So nobody who receives, answers or supervises stands
// still because a terminal is stopped or the reader of a pipe has gone to sleep. As long as lines
// are taken, they are written before the call returns, and a crash loses none.
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
class PatientSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  /// `fd` stays open longer. At most `room` bytes are kept; what comes then is dropped, and a line
  /// where it is missing tells how many.
  explicit PatientSink(int fd, std::size_t room = std::size_t{1} << 20U);
  /// Waits for the reader of what is kept, a second at most.
  ~PatientSink() override;

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override;
  void flush_() override {}

 private:
  using Lock = std::unique_lock<std::mutex>;

  /// Writes what is taken at once; what is left of `text` is returned.
  [[nodiscard]] std::string_view write_now(std::string_view text) const;
  void keep(std::string_view text);
  void start_writer();
  void write_kept();
  void tell_of_the_dropped();

  const int fd_;
  const std::size_t room_;
  // Not the mutex of base_sink, which whoever logs holds: this one is never held for long.
  std::mutex lock_;
  std::deque<std::string> kept_;
  std::size_t size_ = 0;
  std::uint64_t dropped_ = 0;
  bool ending_ = false;
  bool writing_ = false;
  std::thread writer_;
};

}  // namespace millrace::base::program
