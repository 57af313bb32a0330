// What is said once, however often it happens: a stranger may send the same nonsense 20,000 times a
// second. Pure.
//
//   if (auto line = complaints.note("a forged reply", uuid, text, now)) log->warn(*line);
//   …
//   for (const std::string& line : complaints.due(now)) log->warn(line);   // now and then
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

namespace millrace::services::lcm {

class Complaints {
 public:
  /// Of more kinds at a time only their number is kept.
  static constexpr std::size_t most_kinds = 64;
  /// What comes again within this time is counted; a kind that has not come for so long is new.
  static constexpr std::chrono::seconds pause{60};

  /// The line to log, if this is the first of its kind, about this. Otherwise it is counted.
  std::optional<std::string> note(const std::string& kind, const std::string& about,
                                  const std::string& text, fabric::SteadyTime now);
  /// How many more there were, of each kind whose pause is over.
  std::vector<std::string> due(fabric::SteadyTime now);

 private:
  struct Heard {
    fabric::SteadyTime since{};
    std::uint64_t more = 0;
    /// The last one.
    std::string text{};
  };

  std::map<std::pair<std::string, std::string>, Heard> heard_;
  /// When there are too many kinds.
  std::optional<Heard> others_;
};

}  // namespace millrace::services::lcm
