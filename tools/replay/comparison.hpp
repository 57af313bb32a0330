// Compares a response with the recorded one. Pure.
//
//   Tolerances tolerances;
//   tolerances.add("560aacbf-…=0.1%");
//   if (const auto difference = compare(recorded, answer, tolerances.of(uuid))) …
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "tools/replay/plan.hpp"

namespace millrace::tools::replay {

/// How far a number in a response may be from the recorded one.
struct Tolerance {
  double value = 0;
  /// `value` is a share of the recorded number.
  bool relative = false;
};

class Tolerances {
 public:
  /// "UUID=0.001", "UUID=0.1%", or without UUID for all services that have none of their own. The
  /// error names what was expected.
  tl::expected<void, std::string> add(std::string_view text);
  /// Nothing if the responses of this service must be exact.
  [[nodiscard]] std::optional<Tolerance> of(const std::string& uuid) const;

 private:
  std::optional<Tolerance> for_all_;
  /// By canonical UUID.
  std::map<std::string, Tolerance> by_uuid_;
};

struct Difference {
  /// "the text differs", "the state differs".
  std::string what{};
  /// The first byte of the texts that differs.
  std::optional<std::size_t> at{};
};

/// With a tolerance, the numbers of the texts are compared as numbers and the rest byte by byte;
/// the states must always be equal. If the recording leaves a text out, its size is compared,
/// unless there is a tolerance.
std::optional<Difference> compare(const Answer& recorded, const Answer& got,
                                  const std::optional<Tolerance>& tolerance);

// The outcome of a replayed call, and whether it equals the recorded one. Pure.

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
