// A fault that lasts, and would fill a log: what comes again and again is said the first time, and
// then at intervals that grow, with how often it came. Pure.
//
//   if (auto line = repeats.note("write", "disk full", now)) log->error("{}", *line);
//   …
//   repeats.over("write");            // the next one is a first one again
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

  /// Until the second line of a kind; each of the next comes after twice the time, up to `longest`.
  static constexpr std::chrono::seconds first_pause{10};
  static constexpr std::chrono::seconds longest_pause{3600};
  /// So many kinds are told apart; of more, the one that was heard least lately is forgotten.
  static constexpr std::size_t most_kinds = 64;

  /// What has not come for so long, nor for its pause, is new.
  static constexpr std::chrono::seconds quiet{300};

  /// The line to log, if it is time for one.
  std::optional<std::string> note(const std::string& kind, const std::string& text, Time now);
  /// The fault is over. Returns how often it came.
  std::uint64_t over(const std::string& kind);

 private:
  struct Heard {
    std::uint64_t times = 0;
    /// Of them those since the last line.
    std::uint64_t unsaid = 0;
    Time said{};
    Time last{};
    std::chrono::seconds pause = first_pause;
  };

  void forget_one();

  std::map<std::string, Heard> heard_;
};

}  // namespace millrace::base::program
