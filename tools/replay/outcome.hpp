// The outcome of a replayed call, and whether it equals the recorded one. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "tools/replay/comparison.hpp"
#include "tools/replay/plan.hpp"

namespace millrace::tools::replay {

struct Outcome {
  /// Its index in the plan.
  std::size_t call = 0;
  /// From 1.
  std::size_t round = 1;
  /// Nothing if there was no response.
  std::optional<Answer> answer{};
  /// Why there is no response.
  std::string reason{};
  /// From the request to its end.
  nanoseconds took{};
  /// How long after its due time it was issued.
  nanoseconds late{};
  /// It waited for the call before it in its channel; then `late` is not a timing error.
  bool held_up = false;
};

enum class Verdict : std::uint8_t {
  /// Answered as recorded.
  same,
  differs,
  /// Answered; not compared.
  answered,
  /// Answered; the recording has no response to compare with.
  not_recorded,
  /// Withdrawn, as in the recording.
  withdrawn,
  unanswered
};
inline constexpr std::size_t verdict_count = 6;

/// "same", "differs", …
std::string_view name_of(Verdict verdict);
/// The outcome differs from the recorded one.
[[nodiscard]] inline bool is_failure(Verdict verdict) {
  return verdict == Verdict::differs || verdict == Verdict::unanswered;
}

/// Which response counts.
enum class Side : std::uint8_t {
  /// That of the service.
  service,
  /// The one that the program got: that of the gateway or an operator, if there was one.
  program
};

/// The recorded response to compare with; nullptr if there is none.
const TimedAnswer* expected_of(const PlannedCall& call, Side side);

struct Judgement {
  Verdict verdict = Verdict::answered;
  std::optional<Difference> difference{};
};

/// Without `tolerances` (nullptr) nothing is compared.
Judgement judge(const PlannedCall& call, const Outcome& outcome, Side side,
                const Tolerances* tolerances);

}  // namespace millrace::tools::replay
