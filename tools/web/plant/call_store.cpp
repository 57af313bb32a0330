#include "tools/web/plant/call_store.hpp"

#include "base/text/ascii.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::web::plant {

namespace {

bool has_text(std::string_view cp1252, const std::string& wanted) {
  return base::text::small_letters(print::text_json(cp1252)).find(wanted) != std::string::npos;
}

}  // namespace

bool NormalStates::contain(const std::string& uuid, std::uint32_t state) const {
  if (state <= 1) {
    return true;
  }
  const auto of_service = more.find(uuid);
  return of_service != more.end() && of_service->second.contains(state);
}

std::string_view EndedCall::result() const {
  if (call.outcome() == recording::Outcome::withdrawn) {
    return "withdrawn";
  }
  return failed ? "failed" : other_state ? "other_state" : "answered";
}

bool CallFilter::takes(const EndedCall& ended) const {
  const recording::Call& call = ended.call;
  const auto has = [&](const recording::Step* step) {
    return step != nullptr && has_text(step->text, text);
  };
  return (machine.empty() || call.key.machine == machine) &&
         (channel == 0 || call.key.channel == channel) && (uuid.empty() || call.uuid == uuid) &&
         (instance.empty() || call.instance().to_string() == instance) &&
         ((!failed && !other_state) || (failed && ended.failed) ||
          (other_state && ended.other_state)) &&
         (result.empty() || ended.result() == result) &&
         (text.empty() || has(call.first(recording::Stage::seen)) ||
          has(call.first(recording::Stage::written)));
}

const EndedCall* CallStore::add(const recording::Entry& entry) {
  names_.add(entry);
  const fabric::CallId id = recording::call_of(entry);
  const bool is_event = std::holds_alternative<fabric::Event>(entry.sample);
  const bool shows_a_step = is_event || std::holds_alternative<fabric::Request>(entry.sample) ||
                            std::holds_alternative<fabric::Reply>(entry.sample);
  if (id == fabric::CallId{} || !shows_a_step) {
    return nullptr;
  }
  Kept& kept = open(id);
  recording::Call& call = kept.call.call;
  call.add(entry);
  if (kept.ended) {
    // A reply may arrive after the end of its call, from another writer.
    judge(kept.call);
    return nullptr;
  }
  if (call.end() == nullptr) {
    if (is_event) {
      under_way_[call.key] = id;
    }
    return nullptr;
  }
  if (const auto current = under_way_.find(call.key);
      current != under_way_.end() && current->second == id) {
    under_way_.erase(current);
  }
  kept.ended = true;
  kept.call.instance = names_.of(call.instance());
  judge(kept.call);
  open_.erase(id);
  ended_.push_back(id);
  if (ended_.size() > limits_.ended) {
    forget_oldest();
  }
  return &kept.call;
}

void CallStore::judge(EndedCall& ended) const {
  ended.failed = ended.call.outcome() != recording::Outcome::answered;
  ended.other_state = !ended.failed && !normal_.contain(ended.call.uuid, ended.call.end()->state);
}

const recording::Call* CallStore::under_way(const fabric::ChannelKey& key) const {
  const auto current = under_way_.find(key);
  const auto known = current == under_way_.end() ? calls_.end() : calls_.find(current->second);
  return known == calls_.end() ? nullptr : &known->second.call.call;
}

CallStore::Kept& CallStore::open(const fabric::CallId& call) {
  if (const auto known = calls_.find(call); known != calls_.end()) {
    return known->second;
  }
  if (const auto oldest = open_.put(call)) {
    calls_.erase(oldest->key);
  }
  return calls_.emplace(call, Kept{.call = {.call = recording::Call(call)}}).first->second;
}

void CallStore::forget_oldest() {
  const auto oldest = calls_.find(ended_.front());
  ended_.pop_front();
  const EndedCall& ended = oldest->second.call;
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
  return known == calls_.end() ? recording::Timeline{}
                               : recording::timeline_of(known->second.call.call);
}

const EndedCall* CallStore::ended(const fabric::CallId& call) const {
  const auto known = calls_.find(call);
  return known == calls_.end() || !known->second.ended ? nullptr : &known->second.call;
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
