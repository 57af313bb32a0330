// A progress line on the terminal.
#pragma once

#include <chrono>
#include <cstddef>

namespace millrace::tools::commands::replay {

/// Shows nothing if standard error is not a terminal.
class Progress {
 public:
  /// `total` 0 = unknown; `what` is the plural noun of the counted things.
  explicit Progress(std::size_t total, const char* what = "calls");
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Draws it, at most five times a second and not within the first second.
  void show(std::size_t done);
  /// Makes room for other output.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;

  std::size_t total_;
  const char* what_;
  bool terminal_;
  bool drawn_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point next_ = start_ + std::chrono::seconds(1);
};

}  // namespace millrace::tools::commands::replay
