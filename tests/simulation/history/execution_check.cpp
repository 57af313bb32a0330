#include "tests/simulation/history/execution_check.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace millrace::tests::simulation {

std::vector<std::string> ExecutionCheck::on(const Fact& fact, Time) {
  violations_.clear();
  ++facts_;
  std::visit([&](const auto& kind) { on(kind); }, fact);
  return std::exchange(violations_, {});
}

template <typename... Arguments>
void ExecutionCheck::expect(bool right, const char* what, const Arguments&... arguments) {
  if (!right) {
    violations_.push_back(fmt::format(fmt::runtime(what), arguments...));
  }
}

void ExecutionCheck::on(const ProgramAsked& fact) {
  auto& questions = questions_[fact.key];
  if (!questions.empty()) {
    questions.back().stands = false;
  }
  questions.push_back({fact.request, !fact.crossed});
}

void ExecutionCheck::on(const ProgramMoved& fact) {
  if (auto& questions = questions_[fact.key]; !questions.empty()) {
    questions.back().stands = false;
  }
}

void ExecutionCheck::on(const ProgramReleased& fact) {
  on(ProgramMoved{fact.key, "", true});
}

void ExecutionCheck::on(const WriteDone& fact) {
  auto& questions = questions_[fact.key];
  if (!questions.empty()) {
    questions.back().writers.insert(fact.gateway);
  }
  const bool crossed =
      !questions.empty() && (fact.crossed || questions.back().request != fact.request);
  if (!questions.empty() &&
      (crossed ? fact.variable != gateway::Variable::response : fact.answer.has_value())) {
    // A write for an abandoned request may wipe the program's next one.
    questions.back().stands = false;
  }
  for (auto& [call, story] : calls_) {
    if (story.key == fact.key && story.gateway != fact.gateway) {
      // Another gateway has changed what this one sees.
      story.shaken = true;
    }
  }
}

void ExecutionCheck::on(const Claimed& fact) {
  expect(!calls_.contains(fact.call), "the call id {} is given twice", fact.call.to_string());
  expect(!fact.in_trouble, "{} is claimed although the journal cannot be written",
         fact.call.to_string());
  Story& story = calls_[fact.call];
  story.gateway = fact.gateway;
  story.claimed = facts_;
  story.request = fact.request;
  story.key = fact.key;
  auto& questions = questions_[fact.key];
  const auto asked =
      std::find_if(questions.rbegin(), questions.rend(),
                   [&](const Question& question) { return question.request == fact.request; });
  expect(asked != questions.rend(), "{} claims {} \"{}\" state {}, which no program has asked",
         fact.call.to_string(), fact.request.uuid, fact.request.text, fact.request.state);
  if (asked != questions.rend()) {
    story.question = static_cast<std::size_t>(questions.rend() - asked) - 1;
    // Its read may be older than the other gateway's write.
    story.shaken = std::ranges::any_of(
        asked->writers, [&](const GatewayNumber writer) { return writer != fact.gateway; });
  }
}

void ExecutionCheck::on(const Dispatched& fact) {
  const auto found = calls_.find(fact.call);
  if (found == calls_.end()) {
    return;
  }
  Story& story = found->second;
  story.given = true;
  auto& questions = questions_[story.key];
  for (const auto& [call, other] : calls_) {
    const bool same = other.key == story.key && other.question == story.question;
    const auto received = other_calls_.find({story.gateway, call});
    const bool unknown = other.gateway == story.gateway
                             ? other.forgotten
                             : received == other_calls_.end() || received->second > story.claimed;
    if (same && call != fact.call && other.given && unknown && story.question < questions.size()) {
      ++questions[story.question].pardons;
    }
  }
}

void ExecutionCheck::on(const Ended& fact) {
  const auto found = calls_.find(fact.call);
  if (found == calls_.end()) {
    return;
  }
  found->second.ended = true;
  if (fact.answered || found->second.shaken) {
    return;
  }
  const auto& questions = questions_[fact.key];
  const std::size_t question = found->second.question;
  expect(question >= questions.size() || !questions[question].stands,
         "{} is forgotten although its program still waits for it", fact.call.to_string());
}

void ExecutionCheck::on(const Resumed& fact) {
  if (fact.call == fabric::CallId{}) {
    // It has forgotten what it had received.
    std::erase_if(other_calls_,
                  [&](const auto& reply) { return reply.first.first == fact.gateway; });
    for (auto& [call, story] : calls_) {
      story.forgotten = story.forgotten || (story.ended && story.gateway == fact.gateway);
    }
    return;
  }
  if (const auto found = calls_.find(fact.call); found != calls_.end()) {
    found->second.shaken = true;
  }
}

void ExecutionCheck::on(const ChannelStatusReceived& fact) {
  other_calls_.try_emplace({fact.gateway, fact.call}, facts_);
}

void ExecutionCheck::on(const Refused& fact) {
  for (auto& [call, story] : calls_) {
    if (story.gateway == fact.gateway && story.key == fact.key) {
      story.shaken = true;
    }
  }
}

void ExecutionCheck::on(const Started& fact) {
  const auto found = calls_.find(fact.request.call);
  expect(found != calls_.end(), "{} runs, which no gateway has accepted",
         fact.request.call.to_string());
  if (found == calls_.end()) {
    return;
  }
  Story& story = found->second;
  const std::string call = found->first.to_string();
  expect(fact.request.assigned == fact.instance,
         "I9: {} runs at an instance that it was not dispatched to", call);
  expect(story.chances.try_emplace(fact.instance, 1).first->second-- > 0,
         "I9: an instance runs {} twice", call);
  expect(fact.request.text == story.request.text && fact.request.state == story.request.state,
         "{} is run with \"{}\", not with \"{}\"", call, fact.request.text, story.request.text);
  ++story.starts;
  if (fact.delivery == fabric::Delivery::at_most_once) {
    expect(story.starts <= 1 + story.retries, "I4: at-most-once call {} starts {} times", call,
           story.starts);
    if (auto& questions = questions_[story.key]; story.question < questions.size()) {
      Question& question = questions[story.question];
      ++question.once_starts;
      expect(question.once_starts <= 1 + question.pardons,
             "I4: the handler starts {} times for \"{}\", now as {}", question.once_starts,
             question.request.text, call);
    }
  }
}

void ExecutionCheck::on(const Cancelled& fact) {
  if (const auto found = calls_.find(fact.call); found != calls_.end()) {
    ++found->second.chances.try_emplace(fact.instance, 1).first->second;
  }
}

void ExecutionCheck::on(const Retried& fact) {
  if (const auto found = calls_.find(fact.call); found != calls_.end()) {
    ++found->second.retries;
    if (auto& questions = questions_[found->second.key];
        found->second.question < questions.size()) {
      ++questions[found->second.question].pardons;
    }
  }
}

void ExecutionCheck::on(const JournalLost& fact) {
  std::set<std::pair<Key, std::size_t>> pardoned;
  // The request stays in the channel while the journal has lost it: it is accepted again.
  for (const auto& [key, questions] : questions_) {
    if (!questions.empty()) {
      pardoned.emplace(key, questions.size() - 1);
    }
  }
  // Or the last attempt is forgotten, so that an earlier, declined one counts as the last. The same
  // holds for a call whose end is forgotten too, if the program repeats its request.
  for (auto& [call, story] : calls_) {
    if (story.given && (!story.ended || story.gateway == fact.gateway)) {
      ++story.retries;
      pardoned.emplace(story.key, story.question);
    }
  }
  for (const auto& [key, number] : pardoned) {
    if (auto& questions = questions_[key]; number < questions.size()) {
      ++questions[number].pardons;
    }
  }
}

std::vector<std::string> DispatchCheck::on(const Fact& fact, Time) {
  const auto* given = std::get_if<Dispatched>(&fact);
  if (given == nullptr) {
    return {};
  }
  std::vector<std::string> violations;
  const std::string call = given->call.to_string();
  if (!given->ready) {
    violations.push_back(fmt::format(
        "I9: {} is given to an instance that is gone, draining, or of another service", call));
  }
  if (given->load >= given->room) {
    violations.push_back(fmt::format("I9: {} is given to an instance that has {} calls of {}", call,
                                     given->load, given->room));
  }
  return violations;
}

}  // namespace millrace::tests::simulation
