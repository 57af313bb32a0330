#include "tests/simulation/history/outcome_check.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace millrace::tests::simulation {

std::vector<std::string> OutcomeCheck::on(const Fact& fact, Time now) {
  std::visit([&](const auto& one) { on(one, now); }, fact);
  return {};
}

OutcomeCheck::Story* OutcomeCheck::find(const fabric::CallId& call) {
  const auto found = stories_.find(call);
  return found == stories_.end() ? nullptr : &found->second;
}

void OutcomeCheck::on(const Claimed& fact, Time) {
  stories_.try_emplace(fact.call, fact.call, fact.gateway);
  last_[fact.key][fact.gateway] = fact.call;
}

void OutcomeCheck::on(const EventPublished& fact, Time now) {
  const fabric::Event& event = fact.event;
  Story* const story = find(event.call);
  if (story == nullptr) {
    return;
  }
  using enum fabric::EventKind;
  if (event.kind == lost || event.kind == held || event.kind == refused) {
    story->failed.insert(event.attempt);
  }
  story->observed.add({.at = fabric::Time(now), .sample = event});
}

void OutcomeCheck::on(const Dispatched& fact, Time) {
  if (Story* const story = find(fact.call)) {
    story->attempts[fact.instance] = fact.attempt;
  }
}

void OutcomeCheck::on(const Replied& fact, Time now) {
  Story* const story = find(fact.reply.call);
  if (story == nullptr) {
    return;
  }
  if (fact.reply.kind == fabric::ReplyKind::final) {
    story->replies.push_back(fact.reply);
  }
  story->observed.add({.at = fabric::Time(now), .sample = fact.reply});
}

void OutcomeCheck::on(const Answered& fact, Time) {
  if (Story* const story = find(fact.call)) {
    story->response = fact.answer;
  }
}

void OutcomeCheck::on(const Resumed& fact, Time) {
  if (Story* const story = find(fact.call)) {
    story->misled = story->misled || story->response;
    story->reopened = story->reopened || story->response || story->over;
  }
}

void OutcomeCheck::on(const WriteAsked& fact, Time) {
  // RESPONSE_STATE may have its value already, left by an earlier call: then clearing
  // REQUEST_STATE releases the program.
  const bool may_release = fact.variable != gateway::Variable::response ||
                           fact.completion_signal == fabric::CompletionSignal::response;
  Story* const story = find(fact.call);
  if (story != nullptr && may_release) {
    story->misled = story->misled || story->response;
  }
}

void OutcomeCheck::on(const WriteDone& fact, Time) {
  Story* const story = find(fact.call);
  if (story != nullptr && fact.answer) {
    story->released = true;
  }
  for (const auto& [gateway, call] : last_[fact.key]) {
    Story* const other = gateway == fact.gateway ? nullptr : find(call);
    if (other != nullptr && !other->over) {
      other->misled = true;
    }
  }
}

void OutcomeCheck::on(const Ended& fact, Time) {
  if (Story* const story = find(fact.call)) {
    story->over = true;
  }
}

void OutcomeCheck::on(const JournalLost& fact, Time) {
  std::erase_if(stories_, [&](const auto& one) { return one.second.gateway == fact.gateway; });
}

std::set<OutcomeCheck::Verdict> OutcomeCheck::outcomes_of(const Story& story) {
  std::set<Verdict> outcomes;
  if (!story.released) {
    outcomes.insert(story.over ? Verdict::withdrawn : Verdict::under_way);
  }
  if (story.reopened) {
    outcomes.insert(Verdict::withdrawn);
  }
  if (!story.response || (!story.released && !story.misled)) {
    return outcomes;
  }
  const gateway::Answer& response = *story.response;
  if (response.instance == fabric::InstanceId{}) {
    outcomes.insert(Verdict::settled);
    return outcomes;
  }
  // Some services do not count attempts.
  const auto given = story.attempts.find(response.instance);
  const std::uint32_t attempt =
      response.attempt != 0 || given == story.attempts.end() ? response.attempt : given->second;
  if (story.failed.contains(attempt)) {
    outcomes.insert(Verdict::failed);
    return outcomes;
  }
  if (response.attempt == 0 && !story.failed.empty()) {
    // The gateway may not have published the newest attempt of this instance.
    outcomes.insert(Verdict::failed);
  }
  for (const fabric::Reply& reply : story.replies) {
    if (reply.instance == response.instance && reply.attempt == response.attempt &&
        reply.text == response.text && reply.state == response.state) {
      const bool failed =
          reply.code == fabric::ServiceCode::failed || reply.code == fabric::ServiceCode::refused;
      outcomes.insert(failed ? Verdict::failed : Verdict::answered);
    }
  }
  return outcomes;
}

std::vector<std::string> OutcomeCheck::at_the_end() {
  std::vector<std::string> violations;
  for (const auto& [id, story] : stories_) {
    const Verdict observed = story.observed.outcome();
    const std::set<Verdict> outcomes = outcomes_of(story);
    if (!outcomes.contains(observed)) {
      std::vector<std::string_view> names;
      for (const Verdict one : outcomes) {
        names.push_back(name_of(one));
      }
      violations.push_back(fmt::format("an observer takes {} for {}, but it is {}", id.to_string(),
                                       name_of(observed), fmt::join(names, " or ")));
    }
  }
  return violations;
}

}  // namespace millrace::tests::simulation
