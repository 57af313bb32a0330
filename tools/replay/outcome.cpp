#include "tools/replay/outcome.hpp"

#include <array>

namespace millrace::tools::replay {

std::string_view name_of(Verdict verdict) {
  constexpr std::array<std::string_view, verdict_count> names{
      "same", "differs", "answered", "not recorded", "withdrawn", "unanswered"};
  return names.at(static_cast<std::size_t>(verdict));
}

const TimedAnswer* expected_of(const PlannedCall& call, Side side) {
  if (side == Side::program && call.settled) {
    return &*call.settled;
  }
  return call.answer ? &*call.answer : nullptr;
}

Judgement judge(const PlannedCall& call, const Outcome& outcome, Side side,
                const Tolerances* tolerances) {
  if (!outcome.answer) {
    return {call.withdrawn_after ? Verdict::withdrawn : Verdict::unanswered, std::nullopt};
  }
  if (tolerances == nullptr) {
    return {Verdict::answered, std::nullopt};
  }
  const TimedAnswer* const expected = expected_of(call, side);
  if (expected == nullptr) {
    return {Verdict::not_recorded, std::nullopt};
  }
  auto difference = compare(expected->answer, *outcome.answer, tolerances->of(call.uuid));
  return {difference ? Verdict::differs : Verdict::same, std::move(difference)};
}

}  // namespace millrace::tools::replay
