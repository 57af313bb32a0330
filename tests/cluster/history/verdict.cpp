#include "tests/cluster/history/verdict.hpp"

#include <map>
#include <set>

#include <fmt/format.h>

#include "tests/cluster/history/record_check.hpp"

namespace millrace::tests::cluster {

namespace {

/// The journal's entries about one call.
struct Story {
  std::uint32_t attempts = 0;
  bool at_most_once = false;
  std::uint32_t answers = 0;
  std::uint32_t answered_attempt = 0;
  bool ended = false;
  /// A step of the answer was done before the one that must precede it.
  bool out_of_order = false;
};

using Stories = std::map<std::string, Story>;

struct Reader {
  Stories& stories;

  void operator()(const gateway::NumbersEntry&) const {}
  void operator()(const gateway::DispatchedEntry& entry) const {
    Story& story = stories[entry.call.to_string()];
    story.attempts = std::max(story.attempts, entry.attempt);
    story.at_most_once = entry.delivery == fabric::Delivery::at_most_once;
  }
  void operator()(const gateway::InterimEntry&) const {}
  void operator()(const gateway::AnsweredEntry& entry) const {
    Story& story = stories[entry.call.to_string()];
    ++story.answers;
    story.answered_attempt = entry.answer.attempt;
    story.out_of_order = story.out_of_order || story.ended;
  }
  void operator()(const gateway::ClearingEntry& entry) const {
    Story& story = stories[entry.call.to_string()];
    story.out_of_order = story.out_of_order || story.answers == 0 || story.ended;
  }
  void operator()(const gateway::EndedEntry& entry) const {
    stories[entry.call.to_string()].ended = true;
  }
  // Messages of queues are checked by their calls.
  void operator()(const gateway::MessageEntry&) const {}
  void operator()(const gateway::MessageEndedEntry&) const {}
  void operator()(const gateway::LastGetEntry&) const {}
  // For people only.
  void operator()(const gateway::BlockedEntry&) const {}
};

/// The starts of one call's handler.
struct Starts {
  std::multiset<std::string> services;
  std::multiset<std::uint32_t> attempts;
};

std::map<std::string, Starts> starts_of(const std::vector<Execution>& executions) {
  std::map<std::string, Starts> calls;
  for (const Execution& each : executions) {
    if (each.step == Step::started) {
      calls[each.call].services.insert(each.service);
      calls[each.call].attempts.insert(each.attempt);
    }
  }
  return calls;
}

class Checker {
 public:
  void story(const std::string& call, const Story& story) {
    expect(story.answers <= 1, "I1: call {} was answered {} times", call, story.answers);
    expect(story.answered_attempt <= story.attempts,
           "I2: call {} was answered for attempt {}, which was not dispatched", call,
           story.answered_attempt);
    expect(!story.out_of_order, "I3: the answer of call {} was not written step by step", call);
    expect(story.ended, "I5: call {} has not ended", call);
  }

  void starts(const std::string& call, const Starts& starts, const Story& story) {
    expect(!story.at_most_once || starts.services.size() <= 1,
           "I4: the handler of at-most-once call {} started {} times", call,
           starts.services.size());
    for (const std::string& service :
         std::set<std::string>(starts.services.begin(), starts.services.end())) {
      expect(starts.services.count(service) == 1, "I9: {} ran call {} more than once", service,
             call);
    }
    for (const std::uint32_t attempt :
         std::set<std::uint32_t>(starts.attempts.begin(), starts.attempts.end())) {
      expect(starts.attempts.count(attempt) == 1, "I9: attempt {} of call {} ran more than once",
             attempt, call);
    }
  }

  std::vector<std::string> violations;

 private:
  template <typename... Arguments>
  void expect(bool right, fmt::format_string<Arguments...> what, Arguments&&... arguments) {
    if (!right) {
      violations.push_back(fmt::format(what, std::forward<Arguments>(arguments)...));
    }
  }
};

}  // namespace

std::vector<std::string> violations(const History& history) {
  Stories stories;
  for (const gateway::JournalEntry& entry : history.journal) {
    std::visit(Reader{stories}, entry);
  }
  Checker checker;
  for (const auto& [call, story] : stories) {
    checker.story(call, story);
  }
  for (const auto& [call, starts] : starts_of(history.executions)) {
    checker.starts(call, starts, stories[call]);
  }
  std::set<std::string> ended = history.ended_before;
  for (const auto& [call, story] : stories) {
    if (story.ended) {
      ended.insert(call);
    }
  }
  const auto recorded = violations_recorded(history.recording, ended);
  checker.violations.insert(checker.violations.end(), recorded.begin(), recorded.end());
  return checker.violations;
}

}  // namespace millrace::tests::cluster
