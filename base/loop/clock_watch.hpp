// Whether the wall clock can be believed when something is removed for its age: one that jumps
// ahead makes everything old at once, and what is removed does not come back when it is put right.
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
  /// What a clock is put right by without a word.
  static constexpr std::chrono::hours most_correction{1};
  /// A plant may stand still so long.
  static constexpr std::chrono::hours longest_pause{30 * 24};
  /// Somebody has so long to see what was said.
  static constexpr std::chrono::hours doubt{24};

  /// `what` is removed when it is old, and was last written then, if ever.
  ClockWatch(std::string what,
             std::optional<std::chrono::sys_time<std::chrono::nanoseconds>> last_written,
             Clocks now);

  /// Looks at the clocks; called at least every few hours. False for `doubt` after a jump ahead;
  /// one back ends that.
  bool believes(Clocks now);
  /// What has to be said, once.
  std::optional<std::string> news();

 private:
  std::string what_;
  Clocks last_;
  std::optional<std::chrono::steady_clock::time_point> doubt_until_;
  std::optional<std::string> news_;
};

}  // namespace millrace::base::loop
