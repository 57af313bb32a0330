// An accepted call until its end, and its phase. Pure: actions go through the channel's output.
//
//      accepted           from the journal ─── with an answer ───┐
//         │                      │                               │
//      Waiting ◄── verify ── Unverified                          │
//         │ assign                                               │
//      Assigned ── recorded ──► Running                          │
//         │                                                      │
//         └── suspend ──► Waiting, or Held for an operator       │
//                                                                ▼
//      each of these ── take, answer_locally ──► Answered ── recorded ──► Writing ──► close
//
// A phase has what only it needs, numbers of journal entries among them: one whose phase is over is
// invalid. Interim responses are separate from the phases.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "gateway/call_record.hpp"
#include "gateway/channel/answer_writer.hpp"
#include "gateway/channel/channel_output.hpp"
#include "gateway/policy.hpp"
#include "gateway/response.hpp"

namespace millrace::gateway::channel {

/// An answer that no service gave.
struct LocalAnswer {
  Response response;
  /// For people: "the gateway", "operator@host".
  fabric::Message by;
};

/// How a call ended, for later replies.
struct EndedCall {
  std::shared_ptr<const CallRecord> call;
  /// Its answer is written.
  bool answered = false;
};

namespace phase {

/// Of an earlier run; no read has shown yet that its NC program still waits.
struct Unverified {
  /// A response in the journal that a channel cannot take: an earlier version accepted it.
  std::optional<Answer> unwritable{};
};
/// No instance has it.
struct Waiting {
  /// Of the last attempt, while the journal has not confirmed it.
  EntryNumber entry = 0;
};
/// The journal is storing the assignment.
struct Assigned {
  Assignment to;
  EntryNumber entry = 0;
};
/// An instance has it.
struct Running {
  Assignment to;
};
/// An operator must decide.
struct Held {
  /// As in Waiting.
  EntryNumber entry = 0;
  /// Since when it has no instance, until the rule for that was applied; nullopt if it is blocked
  /// for another reason.
  std::optional<SteadyTime> lost_since{};
};
/// It has its response, and the journal is storing it.
struct Answered {
  Response answer;
  EntryNumber entry = 0;
};
/// The answer is being written into the channel.
struct Writing {
  AnswerWriter writer;
  /// Of the entry that says that REQUEST_STATE is about to be cleared.
  EntryNumber clearing = 0;
};

}  // namespace phase

class OpenCall {
 public:
  /// A call for a request that was found just now.
  static OpenCall accepted(CallRecord call, const Policy& policy, SteadyTime now);
  /// A call of an earlier run, from the journal.
  static OpenCall resumed(CallRecord call, const Policy& policy);

  [[nodiscard]] std::shared_ptr<const CallRecord> call() const { return call_; }
  [[nodiscard]] const fabric::CallId& id() const { return call_->id; }
  /// It has its final answer, which does not change any more.
  [[nodiscard]] bool answered() const { return call_->answer.has_value(); }
  /// Its next step has to wait until the journal knows of this one.
  [[nodiscard]] bool waits_for_journal() const;
  [[nodiscard]] bool verified() const { return !std::holds_alternative<phase::Unverified>(phase_); }
  /// An instance may have it, or have had it.
  [[nodiscard]] bool may_be_assigned() const;
  /// The published state of the call.
  [[nodiscard]] ChannelView view() const;

  /// The age of a call of an earlier run is counted from the first link on.
  void on_link_up(Moment now);
  /// The NC program still waits. False if the call was never dispatched: the request is then found
  /// again.
  bool verify(ChannelOutput& out, Moment now);

  // open_call.cpp: its instance. No function affects an answered call.

  /// Gives it to an instance; the same attempt again only repeats it on the fabric.
  void assign(const Assignment& to, ChannelOutput& out, Moment now);
  /// Takes it from its instance. It waits for another one, or, if `held`, for an operator.
  void suspend(const fabric::Message& reason, bool held, ChannelOutput& out, Moment now);
  /// Blocks the call for an operator although this gateway did not dispatch it: it may have run
  /// already.
  void hold(const fabric::Message& reason, ChannelOutput& out, Moment now);
  /// Why it still waits.
  void explain(const fabric::Message& reason);
  /// Removes it from its instance or queue, to be dispatched again.
  void retry(const std::string& by, ChannelOutput& out);
  void on_recorded(EntryNumber recorded, bool read_is_fresh, ChannelOutput& out, Moment now);
  /// Ends the call: its answer is written, or its NC program has continued. Where the answer may
  /// have released the program before that, observers are not told of a withdrawal. Unless `over`
  /// the journal keeps it: until a read shows that its NC program has continued, its request may be
  /// read again.
  EndedCall close(bool written, bool over, const fabric::Message& detail, ChannelOutput& out,
                  Moment now);

  // open_call_answer.cpp: its answer

  /// A reply of an instance that got the call. False if the call has the response of another one.
  bool take(const fabric::Reply& reply, ChannelOutput& out, Moment now);
  /// Answers it instead of the service.
  void answer_locally(const LocalAnswer& answer, ChannelOutput& out, Moment now);
  /// Applies the rules whose time is over.
  void check_deadlines(ChannelOutput& out, Moment now);

  /// Lets the next interim answer begin its way, if it is its turn. `text_is_own`: a text that the
  /// channel shows is of no other writer. Else an equal interim text of another writer would be
  /// taken for the own write, which is still on its way and would land after the final answer.
  void begin_writing(bool text_is_own, ChannelOutput& out);
  /// The response being written, or nullptr.
  [[nodiscard]] AnswerWriter* writer();
  /// The writer's own read, which `status` judges.
  AnswerWriter::Step on_read(const ServiceSnapshot& snapshot, RequestStatus status,
                             ChannelOutput& out, const ReadTime& time);
  /// The state of an interim answer was written just now, or may have been: a kernel may still
  /// clear REQUEST_STATE because of it.
  [[nodiscard]] bool interim_is_fresh(Moment now) const {
    const auto* const writer = std::get_if<AnswerWriter>(&interim_.current);
    return (interim_.at && now.steady - *interim_.at < takes_effect) ||
           (writer != nullptr && writer->may_be_released());
  }
  /// What a read shows about the call, with REQUEST_STATE. It may show the state of the last
  /// interim response; and once REQUEST_STATE has read 0, which a kernel may write after an interim
  /// response, another value is the NC program's next request, even with identical texts.
  RequestStatus on_snapshot(const ServiceSnapshot& snapshot, Moment now);
  /// The program may still wait although both states read 0: a kernel that clears REQUEST_STATE
  /// when an interim answer is written shows that before the state of that answer.
  [[nodiscard]] bool may_show_interim(const ServiceSnapshot& snapshot, RequestStatus status) const;
  /// Makes the journal store that REQUEST_STATE is about to be cleared; false if it is stored
  /// already.
  bool record_clearing(ChannelOutput& out);
  /// An interim answer stands in the channel.
  void interim_written(ChannelOutput& out, Moment now);

 private:
  using Phase = std::variant<phase::Unverified, phase::Waiting, phase::Assigned, phase::Running,
                             phase::Held, phase::Answered, phase::Writing>;

  /// An interim response that the journal is storing; entry 0 once it is stored.
  struct Interim {
    Response response;
    EntryNumber entry = 0;
  };

  /// A refused reply, distinguished from the next one of the same instance: a service without the
  /// SDK may omit the attempt.
  struct Refused {
    Attempt of;
    fabric::Time answered{};
    bool operator==(const Refused&) const = default;
  };

  static constexpr std::size_t most_refused = 16;

  OpenCall(CallRecord call, const Policy& policy, Phase phase)

      : call_(std::make_shared<CallRecord>(std::move(call))),
        policy_(policy),
        phase_(std::move(phase)) {}

  void enter(Phase phase, fabric::Message reason = {});
  [[nodiscard]] EntryNumber unconfirmed_attempt() const;
  [[nodiscard]] const Assignment* assignment() const;
  void publish(const Assignment& to, ChannelOutput& out, Moment now);
  void take_interim(const fabric::Reply& reply, ChannelOutput& out);
  void take_decline(const fabric::Reply& reply, ChannelOutput& out);
  void take_final(const fabric::Reply& reply, ChannelOutput& out, Moment now);
  /// `what` is the mistake; `instead` is the response to the NC program, unless a rule has another
  /// one.
  void refuse(const Attempt& of, const fabric::Message& what, Response instead, ChannelOutput& out,
              Moment now);
  void take_answer(const Attempt& of, Response response, const fabric::Message& detail,
                   ChannelOutput& out, Moment now);
  /// `response` is the text of the program's response, if the rule has one.
  void give_up(const Rule& rule, std::string_view response, const fabric::Message& why,
               ChannelOutput& out, Moment now);
  /// `answer` is the one that it is about, if there is one.
  void publish_event(fabric::EventKind kind, const Attempt& of, const fabric::Message& detail,
                     ChannelOutput& out, Moment now, std::string_view answer = {},
                     std::uint32_t state = 0) const;
  /// Not valid (0) if it is not dispatched.
  [[nodiscard]] Attempt newest_attempt() const;
  void log_end(bool written, const fabric::Message& detail, ChannelOutput& out, Moment now) const;
  [[nodiscard]] std::string name() const { return "call " + call_->id.to_string(); }

  /// The call's data in the journal.
  std::shared_ptr<CallRecord> call_;
  /// The one under which it was accepted.
  Policy policy_;
  Phase phase_;
  /// The reason of its state; empty if none is needed.
  fabric::Message reason_;
  struct {
    /// When it was accepted; for a call of an earlier run not known before the first link.
    std::optional<SteadyTime> since;
    /// False for one that the wall clock, set back since, calls younger than new.
    bool known = false;
    /// The deadline has passed and was logged.
    bool overdue = false;
  } age_;
  struct {
    std::variant<std::monostate, Interim, AnswerWriter> current;
    /// The newest one, while another one is on its way.
    std::optional<Response> next;
    /// One was not written, and that was logged.
    bool refused = false;
    /// When the state of the last one was written.
    std::optional<SteadyTime> at;
    /// No read has shown it yet. The next one waits for that.
    bool unseen = false;
  } interim_;
  /// A read has shown REQUEST_STATE = 0.
  bool zero_seen_ = false;
  /// Instances whose partitions may have the request.
  std::vector<fabric::InstanceId> asked_;
  /// The newest answers that were refused; each may be delivered again.
  std::vector<Refused> refused_;
};

}  // namespace millrace::gateway::channel
