// Decides whether to trust the wall clock before data is removed for its age. A clock that jumps
// ahead makes all data old at once, and removed data does not return when the clock is corrected.
//
//   ClockWatch watch("recordings", last_written, clocks_now());
//   if (watch.believes(clocks_now())) { … }
//   if (auto news = watch.news()) log->warn("{}", *news);
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace millrace::base::loop {

/// Both clocks, read at once.
struct Clocks {
  std::chrono::steady_clock::time_point steady{};
  std::chrono::sys_time<std::chrono::nanoseconds> wall{};
};

Clocks clocks_now();

/// Pure.
class ClockWatch {
 public:
  /// The largest clock correction that is accepted without a warning.
  static constexpr std::chrono::hours most_correction{1};
  /// A plant may be idle for this long.
  static constexpr std::chrono::hours longest_pause{30 * 24};
  /// Time for the operator to react to the warning.
  static constexpr std::chrono::hours doubt{24};

  /// `what` is the data that is removed when it is old; `last_written` is when it was last written,
  /// if ever.
  ClockWatch(std::string what,
             std::optional<std::chrono::sys_time<std::chrono::nanoseconds>> last_written,
             Clocks now);

  /// Compares the clocks; call it at least every few hours. False for `doubt` after a jump ahead; a
  /// jump back ends that.
  bool believes(Clocks now);
  /// The warning to log, once.
  std::optional<std::string> news();

 private:
  std::string what_;
  Clocks last_;
  std::optional<std::chrono::steady_clock::time_point> doubt_until_;
  std::optional<std::string> news_;
};

}  // namespace millrace::base::loop
