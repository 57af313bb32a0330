// I1 At most one final answer is written to a channel per call.
// I2 What is written belongs to the call in the channel: at the last read before the write, its
//    program still waited for it.
// I3 RESPONSE is complete before RESPONSE_STATE ≠ 0, or is written last where the program waits for
//    it alone; a program reads the answer to its own request.
// And: what is written is valid for a channel and does not come from a stranger.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/simulation/history/history.hpp"

namespace millrace::tests::simulation {

class AnswerCheck final : public Check {
 public:
  std::vector<std::string> on(const Fact& fact, Time now) override;

 private:
  /// A request that stood in a channel, and until when.
  struct Stretch {
    gateway::PendingRequest request;
    Time from{};
    std::optional<Time> until;
    /// The call whose answer ended it.
    std::optional<fabric::CallId> answered_by;
  };
  struct Channel {
    std::vector<Stretch> stretches;
    /// The program's last request. The last stretch may be of a request that it had given up.
    std::optional<gateway::PendingRequest> asked{};
    /// REQUEST_STATE is cleared for an answer: a withdrawal of the request is now invisible.
    bool cleared = false;
    /// The request was answered, and RESPONSE_STATE is 0 again without a new request.
    bool wiped = false;
    /// The program has withdrawn its last request, or continued after it, and the texts are
    /// unchanged.
    bool texts_left = false;
    /// The gateway that has written RESPONSE (two gateways that do not hear each other overwrite
    /// each other's text); nothing once the program has emptied it.
    std::optional<GatewayNumber> text_by{};
    /// Only the kernel and this channel's gateways clear REQUEST_STATE.
    bool kernel_clears = false;
    /// A write for an earlier request has hit the present one.
    bool crossed = false;
    /// The gateways that have written since the program's request.
    std::set<GatewayNumber> writers;
    /// The same for the request before.
    std::set<GatewayNumber> writers_before;
    /// All gateways that have ever written.
    std::set<GatewayNumber> all_writers;
  };
  struct LookAt {
    Time first{};
    Time end{};
    gateway::PendingRequest shown{};
  };

  /// The REQUEST_STATE that a gateway has read since it has the call.
  struct Read {
    fabric::CallId call;
    std::uint32_t asked = 0;
    /// It was another value and is that of the request again: the program has written its request
    /// again, perhaps with the same texts.
    bool moved = false;
    bool anew = false;
  };

  void on(const ProgramAsked& fact, Time now);
  void on(const ProgramMoved& fact, Time now);
  void on(const ResponseEmptied& fact, Time now);
  void on(const KernelClears& fact, Time now);
  void on(const ProgramReleased& fact, Time now);
  void on(const SnapshotRead& fact, Time now);
  void on(const WriteAsked& fact, Time now);
  void on(const Claimed& fact, Time now);
  void on(const Answered& fact, Time now);
  void on(const Replied& fact, Time now);
  void on(const WriteDone& fact, Time now);
  void on(const Resumed& fact, Time now);
  void on(const JournalLost& fact, Time now);
  template <typename Other>
  void on(const Other&, Time) {}

  void judge_value(const WriteAsked& fact);
  void judge_writer(const WriteDone& fact);
  static void close(Channel& channel, Time now);
  static void blur(Channel& channel, const gateway::PendingRequest& request);

  std::map<Key, Channel> channels_;
  std::map<std::pair<GatewayNumber, Key>, LookAt> looks_;
  std::map<std::pair<GatewayNumber, Key>, Read> reads_;
  /// The final answers of instances, by call.
  std::map<fabric::CallId, std::vector<fabric::Reply>> replies_;
  /// When a gateway received the answer of a call.
  std::map<std::pair<GatewayNumber, fabric::CallId>, Time> answered_;
  std::map<fabric::CallId, int> finals_;
  /// The request whose REQUEST_STATE a gateway has set to 0, until it sees other texts. A 0 beside
  /// these texts may be that write, whatever the program has done since.
  std::map<std::pair<GatewayNumber, Key>, gateway::PendingRequest> zeroed_;
  /// The calls whose REQUEST_STATE a gateway has begun to clear.
  std::set<fabric::CallId> clearing_;
  std::vector<std::string> violations_;
};

// Replies of instances, and their immediate effects.
//
// - A valid answer reaches the program unchanged. For an invalid one (too long, with a NUL, of
// state
//   0, or without a text if its program waits for that) the program gets an error at once: state
//   500, or what the policy of the accepted call demands, which may be to block it.
// - A reply has no effect on a call that was not dispatched to its instance, or that is answered or
//   over. Nor has an interim answer.
// - What a handler returns after a cancellation is never sent.

class ReplyCheck final : public Check {
 public:
  std::vector<std::string> on(const Fact& fact, Time now) override;

 private:
  void on(const Resumed& fact);
  void on(const Dispatched& fact);
  void on(const Replied& fact);
  void on(const ReplyReceived& fact);
  template <typename Other>
  void on(const Other&) {}
  void expect(bool right, const char* what, const fabric::Reply& reply);
  [[nodiscard]] static bool unchanged(const ReplyReceived& fact);
  void judge_refused(const ReplyReceived& fact);

  /// An answer: its attempt, and its time.
  using AnswerKey = std::tuple<fabric::CallId, fabric::InstanceId, std::uint32_t, fabric::Time>;
  /// The answers that gateways have refused since they started. They may be delivered again.
  std::map<GatewayNumber, std::set<AnswerKey>> refused_;
  std::vector<std::string> violations_;
};

}  // namespace millrace::tests::simulation
