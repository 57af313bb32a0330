#include "tools/recording/hops.hpp"

namespace millrace::tools::recording {

std::string_view name_of(Hop hop) {
  constexpr std::array<std::string_view, hop_count> names{
      "dispatch", "to service", "queue", "work", "to gateway", "write back", "total"};
  return names.at(static_cast<std::size_t>(hop));
}

HopTimes hops_of(const Call& call) {
  const Step* const written = call.last(Stage::written);
  if (written == nullptr) {
    return {};
  }
  const auto between = [](const Step* from,
                          const Step* to) -> std::optional<std::chrono::nanoseconds> {
    if (from == nullptr || to == nullptr || from->at == fabric::Time{} ||
        to->at == fabric::Time{}) {
      return std::nullopt;
    }
    return to->at - from->at;
  };
  const Step* const seen = call.first(Stage::seen);
  const Step* const dispatched = call.of_attempt(Stage::dispatched, call.attempt_of(*written));
  const Step* const received = call.of_attempt(Stage::received, written->attempt);
  const Step* const started = call.of_attempt(Stage::started, written->attempt);
  const Step* const answered = call.of_attempt(Stage::answered, written->attempt);
  const Step* const replied = call.last(Stage::replied);
  return {between(seen, dispatched),  between(dispatched, received), between(received, started),
          between(started, answered), between(answered, replied),    between(replied, written),
          between(seen, written)};
}

void HopStatistics::add(const Entry& entry) {
  for (const Call& call : calls_.add(entry)) {
    count(call);
  }
}

void HopStatistics::close() {
  for (const Call& call : calls_.close()) {
    count(call);
  }
}

void HopStatistics::count_end(const Call& call) {
  // A gateway that resumes may repeat the end of a call, without its other steps.
  if (call.end() != nullptr && call.steps.size() > 1) {
    ++ended_;
    failed_ += call.outcome() == Outcome::answered ? 0U : 1U;
  }
}

void HopStatistics::count(const Call& call) {
  count_end(call);
  if (call.uuid.empty() || call.outcome() == Outcome::withdrawn) {
    return;
  }
  const HopTimes times = hops_of(call);
  for (std::size_t hop = 0; hop < hop_count; ++hop) {
    if (!times.at(hop)) {
      continue;
    }
    if (use_) {
      use_(call.uuid, static_cast<Hop>(hop), *times.at(hop));
    } else {
      const bool has_room = services_.size() < most_services || services_.contains(call.uuid);
      services_[has_room ? call.uuid : further_services].at(hop).add(*times.at(hop));
    }
  }
}

}  // namespace millrace::tools::recording
