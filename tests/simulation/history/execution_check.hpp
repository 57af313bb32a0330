// I4 The handler of an at-most-once call starts at most once per call, across instances and
//    restarts, unless an operator dispatches it again; and at most once per request of the program,
//    unless a journal was lost.
// I9 An attempt runs on the one instance it was dispatched to. An instance runs a call twice only
//    after a cancellation.
// And: a call id is used once, a service gets the program's request unchanged, and an accepted call
//      is not forgotten as long as its program waits for it.
//
// A gateway that takes over from another may dispatch a request once more if it could not know of
// the other's call when it accepted the request.
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
    /// The number of facts when it was accepted.
    std::uint64_t claimed = 0;
    bool given = false;
    bool ended = false;
    /// Its gateway has restarted since it ended.
    bool forgotten = false;
    /// Its gateway has restarted since, or left the channel to another one.
    bool shaken = false;
    /// The index of its request in the channel.
    std::size_t question = 0;
    unsigned starts = 0;
    unsigned retries = 0;
    /// How often each instance may still start it.
    std::map<fabric::InstanceId, int> chances;
  };
  struct Question {
    gateway::PendingRequest request;
    bool stands = true;
    /// The gateways that have written to the channel since this request.
    std::set<GatewayNumber> writers{};
    unsigned once_starts = 0;
    unsigned pardons = 0;
  };

  void on(const ProgramAsked& fact);
  void on(const ProgramMoved& fact);
  void on(const ProgramReleased& fact);
  void on(const WriteDone& fact);
  void on(const Claimed& fact);
  void on(const Dispatched& fact);
  void on(const Ended& fact);
  void on(const Resumed& fact);
  void on(const ChannelStatusReceived& fact);
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
  /// When a gateway first received another gateway's call.
  std::map<std::pair<GatewayNumber, fabric::CallId>, std::uint64_t> other_calls_;
  std::uint64_t facts_ = 0;
  std::vector<std::string> violations_;
};

// A call goes to one instance that is present, takes new calls and has room for it.

class DispatchCheck final : public Check {
 public:
  std::vector<std::string> on(const Fact& fact, Time now) override;
};

}  // namespace millrace::tests::simulation
