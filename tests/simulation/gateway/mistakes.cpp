#include "tests/simulation/gateway/mistakes.hpp"

#include <utility>

#include "gateway/response.hpp"

namespace millrace::tests::simulation {

using gateway::ReadSet;
using gateway::ServiceSnapshot;

void Mistakes::forget() {
  last_looks_.clear();
  last_states_.clear();
  texts_read_.clear();
  last_writes_.clear();
  acknowledged_.clear();
  last_values_.clear();
}

fabric::InstanceIdentity Mistakes::seen(const fabric::InstanceIdentity& instance) const {
  fabric::InstanceIdentity known = instance;
  if (makes(Bug::at_most_once_forgotten)) {
    known.delivery = fabric::Delivery::at_least_once;
  }
  if (makes(Bug::given_to_the_busy)) {
    known.concurrency = 1000;
  }
  return known;
}

fabric::Reply Mistakes::taken_for(const fabric::Reply& reply, const GatewayChecker& checker) const {
  fabric::Reply taken = reply;
  const fabric::CallId current = checker.call_of(reply.key);
  if (makes(Bug::reply_by_channel) && current != fabric::CallId{}) {
    taken.call = current;
  }
  return taken;
}

bool Mistakes::forgets(const fabric::Reply& reply) const {
  return makes(Bug::refused_answer_forgotten) && reply.kind == fabric::ReplyKind::final &&
         !gateway::Response::of(reply.text, reply.state);
}

gateway::machines::Answer Mistakes::taken_for(const std::string& machine,
                                              gateway::machines::Answer answer) {
  using Values = std::vector<gateway::data::Sampler::Answer>;
  auto* const values = std::get_if<Values>(&answer.found);
  if (makes(Bug::old_value_answered) && values != nullptr) {
    Values& last = last_values_[machine];
    if (last.size() == values->size()) {
      std::swap(last, *values);
    } else {
      last = *values;
    }
  }
  return answer;
}

std::optional<ServiceSnapshot> Mistakes::instead_of(const Key& key, gateway::ReadSet set,
                                                    const GatewayChecker& checker) {
  const auto seen = last_looks_.find(key);
  if (makes(Bug::answer_without_look) && set == ReadSet::request && checker.answering(key) &&
      seen != last_looks_.end()) {
    return seen->second;
  }
  const auto texts = texts_read_.extract(key);
  if (!makes(Bug::no_confirming_look) || texts.empty() || set != ReadSet::request) {
    return std::nullopt;
  }
  ServiceSnapshot unread = texts.mapped();
  unread.set = set;
  unread.request_state = last_states_.at(key).request_state;
  return unread;
}

void Mistakes::on_read(const Key& key, const ServiceSnapshot& snapshot) {
  if (snapshot.set == ReadSet::request) {
    last_looks_[key] = snapshot;
  } else if (snapshot.set == ReadSet::state || snapshot.set == ReadSet::states) {
    last_states_[key] = snapshot;
  } else if (snapshot.set == ReadSet::texts) {
    texts_read_.insert_or_assign(key, snapshot);
  }
}

/// Once the program is released, this is forgotten.
ServiceSnapshot Mistakes::taken_for(const Key& key, ServiceSnapshot snapshot) {
  auto found = acknowledged_.find(key);
  if (!makes(Bug::acknowledged_is_seen) || found == acknowledged_.end() ||
      (snapshot.set != ReadSet::all && snapshot.set != ReadSet::states)) {
    return snapshot;
  }
  for (const auto& [variable, value] : found->second) {
    if (variable == gateway::Variable::response && snapshot.has(variable)) {
      snapshot.response = std::get<std::string>(value);
    } else if (variable == gateway::Variable::request_state) {
      snapshot.request_state = std::get<std::uint32_t>(value);
    } else if (variable == gateway::Variable::response_state) {
      snapshot.response_state = std::get<std::uint32_t>(value);
    }
  }
  if (found->second.contains(gateway::Variable::response_state)) {
    acknowledged_.erase(found);
  }
  return snapshot;
}

void Mistakes::on_write(const Key& key, gateway::WriteOutcome outcome) {
  const auto write = last_writes_.find(key);
  if (outcome == gateway::WriteOutcome::written && write != last_writes_.end()) {
    acknowledged_[key].insert_or_assign(write->second.variable, write->second.value);
  }
}

bool Mistakes::keeps(const Key& key, const gateway::Write& write, const GatewayChecker& checker) {
  last_writes_.insert_or_assign(key, write);
  return makes(Bug::state_before_text) && write.variable == gateway::Variable::response &&
         checker.answering(key);
}

std::optional<gateway::Write> Mistakes::again(const Key& key, gateway::WriteOutcome outcome,
                                              const std::string& reason) const {
  if (makes(Bug::unknown_write_repeated) && outcome == gateway::WriteOutcome::unknown &&
      reason == "timeout") {
    return last_writes_.at(key);
  }
  return std::nullopt;
}

bool Mistakes::skips(const gateway::JournalEntry& entry) const {
  return (makes(Bug::message_not_journalled) &&
          std::holds_alternative<gateway::MessageEntry>(entry)) ||
         (makes(Bug::message_end_not_journalled) &&
          std::holds_alternative<gateway::MessageEndedEntry>(entry)) ||
         (makes(Bug::clearing_not_journalled) &&
          std::holds_alternative<gateway::ClearingEntry>(entry)) ||
         (makes(Bug::numbers_not_journalled) &&
          std::holds_alternative<gateway::NumbersEntry>(entry));
}

}  // namespace millrace::tests::simulation
