// What came of a replayed call, and whether that is what came of the recorded one. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "tools/replay/comparison.hpp"
#include "tools/replay/plan.hpp"

namespace millrace::tools::replay {

struct Outcome {
  /// Its place in the plan.
  std::size_t call = 0;
  /// From 1.
  std::size_t round = 1;
  /// None if nobody answered.
  std::optional<Answer> answer{};
  /// Why there is none, in words.
  std::string reason{};
  /// From the request to its end.
  nanoseconds took{};
  /// How long after its time it was issued.
  nanoseconds late{};
  /// It waited for the call before it in its channel; `late` is no error of timing then.
  bool held_up = false;
};

enum class Verdict : std::uint8_t {
  /// Answered as recorded.
  same,
  differs,
  /// Answered; nobody asked whether as recorded.
  answered,
  /// Answered, and the recording has no answer to compare it with.
  not_recorded,
  /// Taken back, as in the recording.
  withdrawn,
  unanswered
};
inline constexpr std::size_t verdict_count = 6;

/// "same", "differs", …
std::string_view name_of(Verdict verdict);
/// The call is not what it was.
[[nodiscard]] inline bool is_failure(Verdict verdict) {
  return verdict == Verdict::differs || verdict == Verdict::unanswered;
}

/// Whose answer counts.
enum class Side : std::uint8_t {
  /// The service's.
  service,
  /// The one that was written to the program: the gateway's or an operator's, if there was one.
  program
};

/// The recorded answer to compare with; nullptr if there is none.
const TimedAnswer* expected_of(const PlannedCall& call, Side side);

struct Judgement {
  Verdict verdict = Verdict::answered;
  std::optional<Difference> difference{};
};

/// `tolerances` is nullptr if nothing is to be compared.
Judgement judge(const PlannedCall& call, const Outcome& outcome, Side side,
                const Tolerances* tolerances);

}  // namespace millrace::tools::replay
