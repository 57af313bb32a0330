#include "cnc/ads/faults.hpp"

#include <algorithm>

namespace millrace::cnc::ads {

void FaultyLine::push(Bytes answer, const Faults& faults, Time now) {
  ++count_;
  if (faults.drop_every != 0 && count_ % faults.drop_every == 0) {
    return;
  }
  const bool slow = faults.out_of_order && count_ % 2 == 1;
  const auto due = now + (slow ? 2 : 1) * faults.delay;
  size_ += answer.size();
  const auto behind = std::ranges::upper_bound(answers_, due, {}, &Answer::due);
  answers_.insert(behind, {due, std::move(answer)});
}

Bytes FaultyLine::take(Time now) {
  Bytes due;
  while (!answers_.empty() && answers_.front().due <= now) {
    const auto& answer = answers_.front().bytes;
    due.insert(due.end(), answer.begin(), answer.end());
    answers_.pop_front();
  }
  size_ -= due.size();
  return due;
}

std::optional<FaultyLine::Time> FaultyLine::next_due() const {
  return answers_.empty() ? std::nullopt : std::optional(answers_.front().due);
}

}  // namespace millrace::cnc::ads
