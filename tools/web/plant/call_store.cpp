#include "tools/web/plant/call_store.hpp"

#include <algorithm>

#include "tools/print/json.hpp"

namespace millrace::tools::web::plant {

namespace {

/// The attempt of an entry that reports a failure.
std::uint32_t attempt_of(const recording::Entry& entry) {
  if (const auto* reply = std::get_if<fabric::Reply>(&entry.sample)) {
    return reply->attempt;
  }
  const auto* event = std::get_if<fabric::Event>(&entry.sample);
  return event == nullptr ? 0 : event->attempt;
}

bool has_text(std::string_view cp1252, const std::string& wanted) {
  return small_letters(print::text_json(cp1252)).find(wanted) != std::string::npos;
}

}  // namespace

std::string small_letters(std::string text) {
  std::ranges::transform(text, text.begin(), [](char letter) {
    return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
  });
  return text;
}

bool NormalStates::contain(const std::string& uuid, std::uint32_t state) const {
  if (state <= 1) {
    return true;
  }
  const auto of_service = more.find(uuid);
  return of_service != more.end() && of_service->second.contains(state);
}

std::string_view EndedCall::result() const {
  if (call.last == fabric::EventKind::withdrawn) {
    return "withdrawn";
  }
  return failed ? "failed" : other_state ? "other_state" : "answered";
}

bool CallFilter::takes(const EndedCall& ended) const {
  const recording::FollowedCall& call = ended.call;
  return (machine.empty() || call.key.machine == machine) &&
         (channel == 0 || call.key.channel == channel) && (uuid.empty() || call.uuid == uuid) &&
         (instance.empty() || call.instance.to_string() == instance) &&
         ((!failed && !other_state) || (failed && ended.failed) ||
          (other_state && ended.other_state)) &&
         (result.empty() || ended.result() == result) &&
         (text.empty() || has_text(call.request.value_or(""), text) ||
          has_text(call.response, text));
}

const EndedCall* CallStore::add(const recording::Entry& entry) {
  std::optional<recording::FollowedCall> over = follower_.add(entry);
  const fabric::CallId call = recording::call_of(entry);
  const bool tells_of_its_way = std::holds_alternative<fabric::Request>(entry.sample) ||
                                std::holds_alternative<fabric::Reply>(entry.sample) ||
                                std::holds_alternative<fabric::Event>(entry.sample);
  if (call == fabric::CallId{} || !tells_of_its_way) {
    return nullptr;
  }
  Kept& kept = open(call);
  kept.timeline.add(entry);
  if (recording::is_failure(entry)) {
    // A failed attempt before the last one is not a failure of the call.
    kept.failed_attempt = std::max(kept.failed_attempt, attempt_of(entry));
    if (kept.ended && kept.failed_attempt == kept.ended->call.attempt) {
      // A reply may arrive after the end of its call, from another writer.
      kept.ended->failed = true;
      kept.ended->other_state = false;
    }
  }
  if (!over) {
    return nullptr;
  }
  end(kept, std::move(*over));
  return &*kept.ended;
}

CallStore::Kept& CallStore::open(const fabric::CallId& call) {
  if (const auto known = calls_.find(call); known != calls_.end()) {
    return known->second;
  }
  if (open_.size() >= limits_.open) {
    calls_.erase(open_.front());
    open_.pop_front();
  }
  const auto place = open_.insert(open_.end(), call);
  return calls_.emplace(call, Kept{.timeline = recording::TimelineBuilder(call), .place = place})
      .first->second;
}

void CallStore::end(Kept& kept, recording::FollowedCall call) {
  const bool answered_by_a_service =
      call.last == fabric::EventKind::written && call.instance != fabric::InstanceId{};
  if (kept.ended) {
    return;  // A gateway that resumed has repeated the end.
  }
  open_.erase(kept.place);
  ended_.push_back(call.id);
  const bool failed =
      !answered_by_a_service || (call.attempt > 0 && kept.failed_attempt == call.attempt);
  const bool other_state = !failed && !normal_.contain(call.uuid, call.response_state);
  kept.ended = EndedCall{std::move(call), failed, other_state};
  if (ended_.size() > limits_.ended) {
    forget_oldest();
  }
}

void CallStore::forget_oldest() {
  const auto oldest = calls_.find(ended_.front());
  ended_.pop_front();
  const EndedCall& ended = *oldest->second.ended;
  if ((!ended.failed && !ended.other_state) || limits_.failed == 0) {
    calls_.erase(oldest);
    return;
  }
  failed_.push_back(oldest->first);
  if (failed_.size() > limits_.failed) {
    calls_.erase(failed_.front());
    failed_.pop_front();
  }
}

recording::Timeline CallStore::timeline(const fabric::CallId& call) const {
  const auto known = calls_.find(call);
  return known == calls_.end() ? recording::Timeline{} : known->second.timeline.build();
}

const EndedCall* CallStore::ended(const fabric::CallId& call) const {
  const auto known = calls_.find(call);
  return known == calls_.end() || !known->second.ended ? nullptr : &*known->second.ended;
}

std::vector<const EndedCall*> CallStore::list(const CallFilter& filter, std::size_t most) const {
  std::vector<const EndedCall*> found;
  for (const std::deque<fabric::CallId>* part : {&ended_, &failed_}) {
    for (auto id = part->rbegin(); id != part->rend() && found.size() < most; ++id) {
      const EndedCall* call = ended(*id);
      if (filter.takes(*call)) {
        found.push_back(call);
      }
    }
  }
  return found;
}

const EndedCall* CallStore::oldest() const {
  if (!failed_.empty()) {
    return ended(failed_.front());
  }
  return ended_.empty() ? nullptr : ended(ended_.front());
}

}  // namespace millrace::tools::web::plant
