// Limits repeated log lines: a stranger may cause the same warning 20,000 times a second. Pure.
//
//   if (auto line = log_limiter.admit("a forged reply", uuid, text, now)) log->warn(*line);
//   …
//   for (const std::string& line : log_limiter.due(now)) log->warn(line);   // now and then
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fabric/moment.hpp"

namespace millrace::fabric {

class LogLimiter {
 public:
  /// Further kinds are only counted.
  static constexpr std::size_t most_kinds = 64;
  /// Repeats within this time are counted; after this time without one a kind is new.
  static constexpr std::chrono::seconds pause{60};

  /// The line to log, with the number of suppressed repeats, if this is the first of its kind and
  /// subject or the pause is over. Otherwise it is counted.
  std::optional<std::string> admit(const std::string& kind, const std::string& about,
                                   const std::string& text, SteadyTime now);
  /// The counts of suppressed lines, for each kind whose pause is over: so that kinds which do not
  /// repeat are reported too.
  std::vector<std::string> due(SteadyTime now);

 private:
  struct Kind {
    SteadyTime since{};
    std::uint64_t more = 0;
    /// The last one.
    std::string text{};
  };

  static std::optional<std::string> admit(Kind& line, const std::string& text, SteadyTime now);

  std::map<std::pair<std::string, std::string>, Kind> kinds_;
  /// When there are too many kinds.
  std::optional<Kind> others_;
};

/// Limits different lines: as many as people read, and the number of further ones.
///
///   Throttle lines(1000, 10s);
///   if (lines.admit(now)) log->info(…);
///   if (auto left_out = lines.due(now)) log->warn("{} more …", *left_out);
class Throttle {
 public:
  Throttle(std::size_t most, std::chrono::seconds window) : most_(most), window_(window) {}

  /// Whether there is room for one more in this window.
  bool admit(SteadyTime now);
  /// The number of lines that were not admitted, when their window is over and there were any.
  std::optional<std::uint64_t> due(SteadyTime now);
  [[nodiscard]] std::size_t most() const { return most_; }
  [[nodiscard]] std::chrono::seconds window() const { return window_; }

 private:
  std::size_t most_;
  std::chrono::seconds window_;
  std::optional<SteadyTime> since_;
  std::uint64_t asked_ = 0;
};

}  // namespace millrace::fabric
