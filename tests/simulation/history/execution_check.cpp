#include "tests/simulation/history/execution_check.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace millrace::tests::simulation {

std::vector<std::string> ExecutionCheck::on(const Fact& fact, Time) {
  violations_.clear();
  std::visit([&](const auto& one) { on(one); }, fact);
  return std::exchange(violations_, {});
}

template <typename... Arguments>
void ExecutionCheck::expect(bool right, const char* what, const Arguments&... arguments) {
  if (!right) {
    violations_.push_back(fmt::format(fmt::runtime(what), arguments...));
  }
}

void ExecutionCheck::on(const ProgramAsked& fact) {
  questions_[fact.key].push_back({fact.request, 0, 0});
}

void ExecutionCheck::on(const Claimed& fact) {
  expect(!calls_.contains(fact.call), "the call id {} is given twice", fact.call.to_string());
  expect(!fact.in_trouble, "{} is claimed although the journal cannot be written",
         fact.call.to_string());
  Story& story = calls_[fact.call];
  story.request = fact.request;
  story.key = fact.key;
  auto& questions = questions_[fact.key];
  const auto asked = std::find_if(questions.rbegin(), questions.rend(),
                                  [&](const Question& one) { return one.request == fact.request; });
  expect(asked != questions.rend(), "{} claims {} \"{}\" state {}, which no program has asked",
         fact.call.to_string(), fact.request.uuid, fact.request.text, fact.request.state);
  if (asked != questions.rend()) {
    story.question = static_cast<std::size_t>(questions.rend() - asked) - 1;
  }
}

void ExecutionCheck::on(const Started& fact) {
  const auto found = calls_.find(fact.request.call);
  expect(found != calls_.end(), "{} runs, which nobody has claimed", fact.request.call.to_string());
  if (found == calls_.end()) {
    return;
  }
  Story& story = found->second;
  const std::string call = found->first.to_string();
  expect(fact.request.assigned == fact.instance, "I9: {} runs at an instance that does not have it",
         call);
  expect(story.instances.insert(fact.instance).second, "I9: an instance runs {} twice", call);
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

void ExecutionCheck::on(const Retried& fact) {
  if (const auto found = calls_.find(fact.call); found != calls_.end()) {
    ++found->second.retries;
    if (auto& questions = questions_[found->second.key];
        found->second.question < questions.size()) {
      ++questions[found->second.question].pardons;
    }
  }
}

void ExecutionCheck::on(const JournalLost&) {
  // The request is still there, the memory of it is not: it is claimed anew.
  for (auto& [key, questions] : questions_) {
    if (!questions.empty()) {
      ++questions.back().pardons;
    }
  }
}

}  // namespace millrace::tests::simulation
