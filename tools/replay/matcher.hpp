// Answers live calls from a recording: in each channel the recorded calls, in their order. Pure.
//
//   Matcher matcher(plan, keys);
//   const Match match = matcher.on_request(request);    // the recorded call, or why there is none
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tools/replay/plan.hpp"

namespace millrace::tools::replay {

/// The call that was recorded in the live one's place.
struct Matched {
  std::size_t call = 0;
  /// The same live call as before, given out again.
  bool repeated = false;
};
/// Why no recorded call matches.
struct Mismatch {
  /// For an operator: the request and the answer that was expected next.
  std::string reason{};
  /// The same in at most 127 bytes of CP1252, for the program.
  std::string text{};
  /// The same live call as before, given out again.
  bool repeated = false;
};
using Match = std::variant<Matched, Mismatch>;

class Matcher {
 public:
  /// `channels`: the live channel of each recorded one. `rounds`: how many times the recording is
  /// gone through; 0 = for ever. `plan` outlives the matcher.
  Matcher(const Plan& plan, const std::map<fabric::ChannelKey, fabric::ChannelKey>& channels,
          std::size_t rounds = 1);

  /// The next recorded call of the channel if UUID, text and state are its; the same as before for
  /// a call that is repeated. A call that does not match leaves the next one as it is.
  Match on_request(const fabric::Request& request);

  /// All recorded calls have been made.
  [[nodiscard]] bool complete() const;
  /// Recorded calls that have not been made, of all rounds (of one if there is no end).
  [[nodiscard]] std::size_t missing() const;

 private:
  struct ChannelCalls {
    std::vector<std::size_t> calls;
    std::size_t next = 0;
    std::size_t rounds_done = 0;
    /// The last live call, and what it was taken for.
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
