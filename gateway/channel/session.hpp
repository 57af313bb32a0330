// One channel's conversation with its controller and the fabric: finds requests, claims them,
// brings the answers back. Pure: takes events and times, returns actions.
//
//   ChannelSession session({"cnc", 1});
//   auto actions = session.on_link_up(now);          → Read{ReadSet::state}
//   actions = session.on_read(snapshot, now);         → … → Offer{request}
//   actions = session.claim(id, now);                → Tell{seen}, Show{waiting}
//   actions = session.assign(attempt, now);          → Record{Dispatched}, then Publish
//   actions = session.on_reply(reply, now);          → Record{Answered}, Read, Write, Write, Write
//
// After each input the actions are carried out in their order.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "gateway/action.hpp"
#include "gateway/call.hpp"
#include "gateway/channel/answer_writer.hpp"
#include "gateway/channel/request_watch.hpp"
#include "gateway/pace.hpp"
#include "gateway/policy.hpp"

namespace millrace::gateway::channel {

/// An answer that no service gave.
struct Settlement {
  std::string text;
  std::uint32_t state = 0;
  /// For people: "the gateway", "operator@host".
  std::string by;
};

class ChannelSession {
 public:
  explicit ChannelSession(fabric::ChannelKey key, Pace pace = {});

  /// A call of an earlier run, from the journal; before the link comes up.
  void resume(Call call, const Policy& policy);

  Actions on_link_up(Moment now);
  /// Asks nothing of the controller any more; on_link_down() or on_link_dropped() follows.
  void lose_link() { link_up_ = false; }
  Actions on_link_down(const std::string& reason, Moment now);
  /// The link was taken away: what was asked of it is not answered any more.
  Actions on_link_dropped(const std::string& reason, Moment now);
  Actions on_wake(Moment now);
  Actions on_read(const Snapshot& snapshot, Moment now);
  /// `reason` in words, with the code.
  Actions on_read_failed(const std::string& reason, Moment now);
  Actions on_write(WriteOutcome outcome, const std::string& reason, Moment now);
  Actions on_recorded(std::uint64_t ticket, Moment now);

  /// Takes the offered request under this id.
  Actions claim(fabric::CallId id, const Policy& policy, Moment now);
  /// Leaves the offered request alone; `reason` says why.
  Actions leave(const std::string& reason, const Policy& policy, Moment now);
  /// Offers a request again that was left: somebody new is there.
  Actions reconsider(Moment now);

  /// Gives the call to an instance; the same attempt again only repeats it on the fabric.
  Actions assign(const Assignment& assignment, Moment now);
  /// Takes the call from its instance. It waits for another one, or, if `held`, for an operator.
  Actions suspend(const std::string& reason, bool held, Moment now);
  /// Keeps a call that was just claimed for an operator: it may have run already.
  Actions hold(const std::string& reason, Moment now);
  /// Why the call still waits.
  Actions explain(const std::string& reason, Moment now);
  Actions on_reply(const fabric::Reply& reply, Moment now);
  /// Answers the call in the service's place, if it has no answer yet.
  Actions settle(const Settlement& settlement, Moment now);
  /// Takes the call from wherever it is; the dispatcher gives it out again.
  Actions retry(const std::string& by, Moment now);

  /// The configuration or another gateway takes the channel away. Finishes the call under way, or
  /// ends it at once, and takes no new one; then is_over().
  Actions retire(Moment now);
  Actions release(const std::string& reason, Moment now);
  /// It is ours again, or still.
  Actions keep(Moment now);
  /// The gateway ends: another one may give the call under way out if this one has not.
  Actions let_go(Moment now);
  /// A call is under way, and an instance may have it, or have had it.
  [[nodiscard]] bool may_be_given() const;
  /// Nothing is left to do here, and nothing is on its way to the controller.
  [[nodiscard]] bool is_over() const { return retired_ && !active_ && io_ == Io::none; }
  [[nodiscard]] bool retired() const { return retired_; }
  [[nodiscard]] bool link_up() const { return link_up_; }

  void set_pace(const Pace& pace) { pace_ = pace; }

  [[nodiscard]] const fabric::ChannelKey& key() const { return key_; }
  /// The claimed call, or nullptr.
  [[nodiscard]] const Call* call() const { return active_ ? &active_->call : nullptr; }
  [[nodiscard]] const fabric::ChannelStatus& status() const { return status_; }

 private:
  enum class Io { none, poll, answer };

  /// The claimed call and how far it is. A ticket that is not 0 waits for the journal.
  struct Active {
    Call call;
    /// False until the channel has shown that a resumed call is still pending.
    bool verified = true;
    bool held = false;
    std::string reason;
    /// When it was claimed; set at the first link for a resumed call.
    SteadyTime since{};
    /// False for a resumed call that the wall clock, set back since, calls younger than new.
    bool age_known = false;
    /// An at-most-once call whose instance is lost.
    std::optional<SteadyTime> lost_since;
    bool lost_told = false;
    /// The deadline is over and was told.
    bool overdue = false;
    std::optional<Assignment> assignment;
    /// The newest interim reply, and the one the journal is told of.
    std::optional<fabric::Reply> interim;
    std::optional<fabric::Reply> recorded_interim;
    std::optional<AnswerWriter> writer;
    std::uint64_t dispatch_ticket = 0;
    std::uint64_t interim_ticket = 0;
    std::uint64_t answer_ticket = 0;
    std::uint64_t clearing_ticket = 0;
  };

  /// How the last call ended, for the replies that come after it.
  struct Past {
    fabric::CallId call;
    bool answered = false;
    fabric::InstanceId answered_by;
  };

  // session.cpp: the channel
  Actions finish(Moment now);
  void put(Action action);
  void advance(Moment now);
  void poll(const Snapshot& snapshot, Moment now);
  void poll_call(const Snapshot& snapshot, Moment now);
  /// The channel is another gateway's, which finds the request there.
  [[nodiscard]] bool other_can_see(const Snapshot& snapshot) const;
  void leave_to_the_other(Moment now);
  void read(ReadSet look, Io io);
  void write(Variable variable, Value value);
  void wake_at(SteadyTime at);
  std::uint64_t record(JournalEntry entry);
  [[nodiscard]] ReadSet poll_look(Moment now) const;
  void hold_off(const std::string& reason, Moment now);

  // session_call.cpp: given out, over
  void publish(Moment now);
  void end(bool answered, const std::string& detail, Moment now);

  // session_reply.cpp: what instances say
  void take_final(const fabric::Reply& reply, Moment now);
  void take_interim(const fabric::Reply& reply);
  void take_answer(Answer answer, fabric::Event event, Moment now);
  void refuse(const fabric::Reply& reply, const std::string& why, Moment now);
  void late(const fabric::Reply& reply, Moment now);

  // session_patience.cpp: what happens when no service answers
  void check_patience(Moment now);
  void give_up(const Rule& rule, const std::string& why, Moment now);
  void answer_instead(const Settlement& settlement, Moment now);

  // session_writer.cpp: the way of an answer into the channel
  void start_writer();
  bool drive_writer(Moment now);
  void answer_looked(const Snapshot& snapshot, Moment now);
  void writer_finished(Moment now);

  // session_report.cpp: what people and tools see
  void tell(fabric::EventKind kind, const std::string& detail, Moment now);
  void tell(fabric::Event event, Moment now);
  void say(Level level, std::string text);
  void show(Moment now);
  [[nodiscard]] fabric::ChannelState state() const;
  [[nodiscard]] std::string_view reason() const;

  fabric::ChannelKey key_;
  Pace pace_;
  Actions out_;
  fabric::ChannelStatus status_;
  /// What was shown last.
  std::optional<fabric::ChannelStatus> shown_;

  bool link_up_ = false;
  /// Since the link is up the channel has been seen without a request, or a call of ours has ended.
  bool idle_seen_ = false;
  bool retired_ = false;
  /// Why another gateway has the channel; then a call is kept only if the other cannot see it.
  std::string released_;
  /// What is shown of the channel stays the call that was left to the other gateway, which must not
  /// give it out again.
  bool last_word_ = false;
  std::string link_reason_ = "not connected yet";
  /// What the controller refused last; empty while it answers.
  std::string trouble_;
  Io io_ = Io::none;
  SteadyTime due_{};
  SteadyTime not_before_{};
  SteadyTime active_until_{};
  SteadyTime whole_due_{};
  SteadyTime looked_at_{};

  RequestWatch watch_;
  std::optional<PendingRequest> offered_;
  std::string left_reason_;
  SteadyTime left_at_{};
  /// The request nobody serves has waited for as long as its policy says.
  bool out_of_patience_ = false;
  /// Of the request that is left, or of the call.
  Policy policy_;
  std::optional<Active> active_;
  std::optional<Past> past_;
  std::uint64_t next_ticket_ = 1;
};

}  // namespace millrace::gateway::channel
