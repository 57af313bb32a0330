#include "tests/simulation/history/outcome_check.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace millrace::tests::simulation {

std::vector<std::string> OutcomeCheck::on(const Fact& fact, Time now) {
  std::visit([&](const auto& kind) { on(kind, now); }, fact);
  return {};
}

OutcomeCheck::KnownCall* OutcomeCheck::find(const fabric::CallId& call) {
  const auto found = known_.find(call);
  return found == known_.end() ? nullptr : &found->second;
}

void OutcomeCheck::on(const Claimed& fact, Time) {
  KnownCall& known = known_.try_emplace(fact.call, fact.call, fact.gateway).first->second;
  const auto answered = answered_by_.find(fact.key);
  known.misled |= crossed_.contains(fact.key) ||
                  (answered != answered_by_.end() && answered->second != fact.gateway);
  last_[fact.key][fact.gateway] = fact.call;
}

void OutcomeCheck::on(const EventPublished& fact, Time now) {
  const fabric::Event& event = fact.event;
  KnownCall* const known = find(event.call);
  if (known == nullptr) {
    return;
  }
  known->refused = known->refused || event.kind == fabric::EventKind::refused;
  known->observed.add({.at = fabric::Time(now), .sample = event});
}

void OutcomeCheck::on(const Replied& fact, Time now) {
  KnownCall* const known = find(fact.reply.call);
  if (known == nullptr) {
    return;
  }
  if (fact.reply.kind == fabric::ReplyKind::final) {
    known->replies.push_back(fact.reply);
  }
  known->observed.add({.at = fabric::Time(now), .sample = fact.reply});
}

void OutcomeCheck::on(const Answered& fact, Time) {
  if (KnownCall* const known = find(fact.call)) {
    known->response = fact.answer;
  }
}

void OutcomeCheck::on(const Resumed& fact, Time) {
  if (KnownCall* const known = find(fact.call)) {
    known->misled = known->misled || known->response;
    known->reopened = known->reopened || known->response || known->over;
  }
}

void OutcomeCheck::on(const WriteAsked& fact, Time) {
  // RESPONSE_STATE may have its value already, left by an earlier call: then clearing
  // REQUEST_STATE releases the program.
  const bool may_release = fact.variable != gateway::Variable::response ||
                           fact.completion_signal == fabric::CompletionSignal::response;
  KnownCall* const known = find(fact.call);
  if (known != nullptr && may_release) {
    known->misled = known->misled || known->response;
  }
}

void OutcomeCheck::on(const WriteDone& fact, Time) {
  KnownCall* const known = find(fact.call);
  if (known != nullptr && fact.answer) {
    known->released = true;
    answered_by_.insert_or_assign(fact.key, fact.gateway);
  }
  for (const auto& [gateway, call] : last_[fact.key]) {
    KnownCall* const other = gateway == fact.gateway ? nullptr : find(call);
    if (other != nullptr && !other->over) {
      other->misled = true;
    }
  }
}

void OutcomeCheck::on(const ProgramAsked& fact, Time) {
  crossed_.erase(fact.key);
  answered_by_.erase(fact.key);
}

void OutcomeCheck::on(const ProgramReleased& fact, Time) {
  if (!fact.crossed) {
    return;
  }
  // The state beside the request is what a kernel that clears REQUEST_STATE shows after an interim
  // response: the gateway writes on, and finds its response and REQUEST_STATE 0.
  crossed_.insert(fact.key);
  for (const auto& [gateway, call] : last_[fact.key]) {
    if (KnownCall* const known = find(call); known != nullptr && !known->over) {
      known->misled = true;
    }
  }
}

void OutcomeCheck::on(const Ended& fact, Time) {
  if (KnownCall* const known = find(fact.call)) {
    known->over = true;
  }
}

void OutcomeCheck::on(const JournalLost& fact, Time) {
  std::erase_if(known_, [&](const auto& known) { return known.second.gateway == fact.gateway; });
}

std::set<OutcomeCheck::Verdict> OutcomeCheck::outcomes_of(const KnownCall& known) {
  std::set<Verdict> outcomes;
  if (!known.released) {
    outcomes.insert(known.over ? Verdict::withdrawn : Verdict::under_way);
  }
  if (known.reopened) {
    outcomes.insert(Verdict::withdrawn);
  }
  if (!known.response || (!known.released && !known.misled)) {
    return outcomes;
  }
  const gateway::Answer& response = *known.response;
  if (response.instance == fabric::InstanceId{}) {
    outcomes.insert(Verdict::settled);
    return outcomes;
  }
  bool published = false;
  for (const fabric::Reply& reply : known.replies) {
    if (reply.instance == response.instance && reply.attempt == response.attempt &&
        reply.text == response.text && reply.state == response.state) {
      const bool failed =
          reply.code == fabric::ServiceCode::failed || reply.code == fabric::ServiceCode::refused;
      outcomes.insert(failed ? Verdict::failed : Verdict::answered);
      published = true;
    }
  }
  if (!published && known.refused) {
    outcomes.insert(Verdict::failed);
  }
  return outcomes;
}

std::vector<std::string> OutcomeCheck::at_the_end() {
  std::vector<std::string> violations;
  for (const auto& [id, known] : known_) {
    const Verdict observed = known.observed.outcome();
    const std::set<Verdict> outcomes = outcomes_of(known);
    if (!outcomes.contains(observed)) {
      std::vector<std::string_view> names;
      for (const Verdict verdict : outcomes) {
        names.push_back(name_of(verdict));
      }
      violations.push_back(fmt::format("an observer takes {} for {}, but it is {}", id.to_string(),
                                       name_of(observed), fmt::join(names, " or ")));
    }
  }
  return violations;
}

}  // namespace millrace::tests::simulation
