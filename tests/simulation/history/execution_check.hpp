// I4 The handler of an at-most-once call starts at most once per call, across instances and
//    restarts, unless an operator has it given out again; and at most once per request of the
//    program, unless a journal was lost.
// I9 An attempt is run by the one instance it was given to, and no instance runs a call twice.
// And: a call id is given once, and what a service is asked is what the program asked.
#pragma once

#include <map>
#include <set>
#include <utility>
#include <vector>

#include "tests/simulation/history/history.hpp"

namespace millrace::tests::simulation {

class ExecutionCheck final : public Check {
 public:
  std::vector<std::string> on(const Fact& fact, Time now) override;

 private:
  struct Story {
    gateway::PendingRequest request;
    Key key;
    /// Which of the channel's requests it stands for.
    std::size_t question = 0;
    unsigned starts = 0;
    unsigned retries = 0;
    std::set<fabric::InstanceId> instances;
  };
  struct Question {
    gateway::PendingRequest request;
    unsigned once_starts = 0;
    unsigned pardons = 0;
  };

  void on(const ProgramAsked& fact);
  void on(const Claimed& fact);
  void on(const Started& fact);
  void on(const Retried& fact);
  void on(const JournalLost& fact);
  template <typename Other>
  void on(const Other&) {}
  template <typename... Arguments>
  void expect(bool right, const char* what, const Arguments&... arguments);

  std::map<fabric::CallId, Story> calls_;
  std::map<Key, std::vector<Question>> questions_;
  std::vector<std::string> violations_;
};

}  // namespace millrace::tests::simulation
