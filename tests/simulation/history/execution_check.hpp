// I4 The handler of an at-most-once call starts at most once per call, across instances and
//    restarts, unless an operator has it given out again; and at most once per request of the
//    program, unless a journal was lost.
// I9 An attempt is run by the one instance it was given to, and no instance runs a call twice, but
//    anew after it was told that nobody waits for it.
// And: a call id is given once, what a service is asked is what the program asked, and a call that
//      was accepted is not forgotten as long as its program waits for it.
//
// A gateway that takes the place of another may give a request out once more if it could not know
// of the other's call when it accepted the request.
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
    GatewayNumber gateway = 0;
    gateway::PendingRequest request;
    Key key;
    /// Of the facts so far, when it was claimed.
    std::uint64_t claimed = 0;
    bool given = false;
    bool ended = false;
    /// Its gateway has started again since it ended.
    bool forgotten = false;
    /// Its gateway has started again since, or left the channel to another one.
    bool shaken = false;
    /// Which of the channel's requests it stands for.
    std::size_t question = 0;
    unsigned starts = 0;
    unsigned retries = 0;
    /// How often each instance may still start it.
    std::map<fabric::InstanceId, int> chances;
  };
  struct Question {
    gateway::PendingRequest request;
    bool stands = true;
    /// The gateways that have written to the channel meanwhile.
    std::set<GatewayNumber> writers{};
    unsigned once_starts = 0;
    unsigned pardons = 0;
  };

  void on(const ProgramAsked& fact);
  void on(const ProgramMoved& fact);
  void on(const ProgramReleased& fact);
  void on(const WriteDone& fact);
  void on(const Claimed& fact);
  void on(const GivenOut& fact);
  void on(const Ended& fact);
  void on(const Resumed& fact);
  void on(const Heard& fact);
  void on(const Refused& fact);
  void on(const Started& fact);
  void on(const Cancelled& fact);
  void on(const Retried& fact);
  void on(const JournalLost& fact);
  template <typename Other>
  void on(const Other&) {}
  template <typename... Arguments>
  void expect(bool right, const char* what, const Arguments&... arguments);

  std::map<fabric::CallId, Story> calls_;
  std::map<Key, std::vector<Question>> questions_;
  /// When a gateway first heard of another's call.
  std::map<std::pair<GatewayNumber, fabric::CallId>, std::uint64_t> heard_;
  std::uint64_t facts_ = 0;
  std::vector<std::string> violations_;
};

}  // namespace millrace::tests::simulation
