#include "tests/simulation/history/history.hpp"

#include <utility>

#include <fmt/format.h>

#include "tests/simulation/history/answer_check.hpp"
#include "tests/simulation/history/execution_check.hpp"
#include "tests/simulation/history/outcome_check.hpp"
#include "tests/simulation/history/queue_check.hpp"

namespace millrace::tests::simulation {

namespace {

double seconds(Time time) {
  return std::chrono::duration<double>(time).count();
}

/// Whether a check remembers the fact beyond the life of its process. What a gateway has read and
/// received is only in its memory.
bool lasts(const Fact& fact) {
  return !std::holds_alternative<SnapshotRead>(fact) &&
         !std::holds_alternative<ChannelStatusReceived>(fact) &&
         !std::holds_alternative<Finished>(fact) && !std::holds_alternative<Replied>(fact) &&
         !std::holds_alternative<Note>(fact);
}

}  // namespace

History::History(Agenda& agenda, Trace trace) : agenda_(agenda), trace_(std::move(trace)) {
  checks_.push_back(std::make_unique<AnswerCheck>());
  checks_.push_back(std::make_unique<DispatchCheck>());
  checks_.push_back(std::make_unique<ExecutionCheck>());
  checks_.push_back(std::make_unique<ReplyCheck>());
  checks_.push_back(std::make_unique<QueueCheck>());
  checks_.push_back(std::make_unique<OutcomeCheck>());
}

void History::add(const Fact& fact) {
  if (trace_) {
    print(to_string(fact));
  }
  if (agenda_.watched() && lasts(fact)) {
    agenda_.remembers(meaning_of(to_string(fact)));
  }
  for (const auto& check : checks_) {
    for (const std::string& sentence : check->on(fact, agenda_.now())) {
      violated(sentence);
    }
  }
}

void History::judge_the_end() {
  for (const auto& check : checks_) {
    for (const std::string& sentence : check->at_the_end()) {
      violated(sentence);
    }
  }
}

void History::note(const std::string& who, const std::string& what) {
  if (trace_) {
    print(to_string(Note{who, what}));
  }
}

void History::violated(const std::string& sentence) {
  violations_.push_back(fmt::format("{}, at {:.6f} s", sentence, seconds(agenda_.now())));
  if (trace_) {
    print("VIOLATION " + sentence);
  }
}

void History::print(const std::string& line) {
  trace_(fmt::format("{:12.6f}  {}", seconds(agenda_.now()), line));
}

}  // namespace millrace::tests::simulation
