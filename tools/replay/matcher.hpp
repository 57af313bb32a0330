// Matches live calls with recorded ones: in each channel the recorded calls in their order. Pure.
//
//   Matcher matcher(plan, keys);
//   const Match match = matcher.on_request(request);    // the recorded call, or a mismatch
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "tools/replay/plan.hpp"

namespace millrace::tools::replay {

/// The recorded call that corresponds to the live one.
struct Matched {
  std::size_t call = 0;
  /// The same live call as before, dispatched again.
  bool repeated = false;
};
/// Why no recorded call matches.
struct Mismatch {
  /// For an operator: the request, and the request that was expected.
  std::string reason{};
  /// The same in at most 127 bytes of CP1252, for the NC program.
  std::string text{};
  /// The same live call as before, dispatched again.
  bool repeated = false;
};
using Match = std::variant<Matched, Mismatch>;

class Matcher {
 public:
  /// `channels`: the live channel of each recorded one. `rounds`: how often the recording is
  /// repeated; 0 = without end. `plan` outlives the matcher.
  Matcher(const Plan& plan, const std::map<fabric::ChannelKey, fabric::ChannelKey>& channels,
          std::size_t rounds = 1);

  /// The next recorded call of the channel if UUID, text and state are equal; for a repeated call
  /// the same as before. A mismatch does not consume the recorded call.
  Match on_request(const fabric::Request& request);

  /// All recorded calls have been made.
  [[nodiscard]] bool complete() const;
  /// Recorded calls that have not been made, of all rounds (of one round if there is no end).
  [[nodiscard]] std::size_t missing() const;

 private:
  struct ChannelCalls {
    std::vector<std::size_t> calls;
    std::size_t next = 0;
    std::size_t rounds_done = 0;
    /// The last live call, and the recorded call that it matched.
    fabric::CallId last{};
    Match match{};
  };

  Match match(ChannelCalls& channel_calls, const fabric::Request& request);
  [[nodiscard]] bool is_over(const ChannelCalls& channel_calls) const {
    return rounds_ != 0 && channel_calls.rounds_done == rounds_;
  }

  const Plan& plan_;
  std::size_t rounds_;
  /// By live channel.
  std::map<fabric::ChannelKey, ChannelCalls> channels_;
};

}  // namespace millrace::tools::replay
