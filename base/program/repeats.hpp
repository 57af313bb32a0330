// Limits the log lines of a lasting fault: a repeated event is logged the first time, and then at
// growing intervals, with its number of repetitions. Pure.
//
//   if (auto line = repeats.note("write", "disk full", now)) log->error("{}", *line);
//   …
//   repeats.over("write");            // the next event counts as the first again
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace millrace::base::program {

class Repeats {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// Time until the second line of a kind; it doubles for each further line, up to `longest_pause`.
  static constexpr std::chrono::seconds first_pause{10};
  static constexpr std::chrono::seconds longest_pause{3600};
  /// The most kinds that are tracked; beyond that, the kind without an event for the longest time
  /// is forgotten.
  static constexpr std::size_t most_kinds = 64;

  /// A kind without an event for this time, and for its pause, counts as new.
  static constexpr std::chrono::seconds quiet{300};

  /// The line to log, if one is due.
  std::optional<std::string> note(const std::string& kind, const std::string& text, Time now);
  /// The fault is over. Returns the number of its events.
  std::uint64_t over(const std::string& kind);

 private:
  struct Line {
    std::uint64_t times = 0;
    /// Events since the last line.
    std::uint64_t unlogged = 0;
    Time logged{};
    Time last{};
    std::chrono::seconds pause = first_pause;
  };

  void forget_one();

  std::map<std::string, Line> lines_;
};

}  // namespace millrace::base::program
