// What an observer concludes of a call (tools/recording/call.hpp), from the events and replies that
// gateways and instances publish, is what has happened to it:
//
// - under way: no gateway has finished it
// - withdrawn: no response has released its program
// - settled: the response that did is of no instance
// - failed: it is of an instance that has published it as an error, or the gateway has written it
//   in place of a response that it refused
// - answered: it is any other response of an instance, which has published it, whatever happened to
//   this or an earlier attempt before
//
// A gateway cannot tell a withdrawal from the effect of its last write if it has restarted, if the
// controller has acknowledged the write without applying it, or if another gateway has written.
// Calls of a gateway that has lost the end of its journal are not judged.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <vector>

#include "tests/simulation/history/history.hpp"
#include "tools/recording/call.hpp"

namespace millrace::tests::simulation {

class OutcomeCheck final : public Check {
 public:
  std::vector<std::string> on(const Fact& fact, Time now) override;
  std::vector<std::string> at_the_end() override;

 private:
  using Verdict = tools::recording::Outcome;

  struct KnownCall {
    explicit KnownCall(const fabric::CallId& call, GatewayNumber of)
        : observed(call), gateway(of) {}

    tools::recording::Call observed;
    GatewayNumber gateway;
    std::optional<gateway::Answer> response{};
    /// Its last write has taken effect.
    bool released = false;
    /// Its gateway has sent a write that may release the program, has restarted with the response,
    /// another gateway has written to the channel, or has answered the same request before, or an
    /// answer to an earlier request has released the program: it may take the call for answered.
    bool misled = false;
    std::vector<fabric::Reply> replies{};
    /// Its gateway has refused a response.
    bool refused = false;
    bool over = false;
    /// Its gateway has restarted with its response, or before it journalled the end that it had
    /// published.
    bool reopened = false;
  };

  void on(const Claimed& fact, Time now);
  void on(const EventPublished& fact, Time now);
  void on(const Replied& fact, Time now);
  void on(const Answered& fact, Time now);
  void on(const Resumed& fact, Time now);
  void on(const WriteAsked& fact, Time now);
  void on(const WriteDone& fact, Time now);
  void on(const ProgramAsked& fact, Time now);
  void on(const ProgramReleased& fact, Time now);
  void on(const Ended& fact, Time now);
  void on(const JournalLost& fact, Time now);
  template <typename Other>
  void on(const Other&, Time) {}
  KnownCall* find(const fabric::CallId& call);
  static std::set<Verdict> outcomes_of(const KnownCall& known);

  std::map<fabric::CallId, KnownCall> known_;
  /// The last call that each gateway has accepted in a channel.
  std::map<Key, std::map<GatewayNumber, fabric::CallId>> last_;
  /// The channels whose newest request has ended with an answer to an earlier one.
  std::set<Key> crossed_;
  /// The gateway that has answered the newest request of a channel.
  std::map<Key, GatewayNumber> answered_by_;
};

}  // namespace millrace::tests::simulation
