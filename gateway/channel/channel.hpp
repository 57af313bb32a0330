// The connection of one channel between its controller and the fabric: polls the channel, finds
// requests and writes responses. Pure: takes events and times; actions go to the context's Outputs,
// and the gateway gets its tasks from take_news(). gateway/channel/open_call.hpp describes accepted
// calls.
//
//   Channel channel({"cnc", 1}, context);
//   channel.on_link_up(now);                  → read(ReadSet::state)
//   channel.on_read(snapshot, now);           → … → take_news().found
//   channel.accept(id, policy, now);          → publish(seen), publish(waiting)
//   channel.assign(attempt, now);             → append(Dispatched), then publish(request)
//   channel.on_reply(reply, now);             → append(Answered), read, write, write, read, write
//
// A REQUEST_STATE is a new request only if a read has shown that the one before it is over
// (gateway/channel/released.hpp), and a write counts only when a read has shown it
// (gateway/channel/answer_writer.hpp): a controller may apply writes any time after it has
// acknowledged them.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/messages/catalogue.hpp"
#include "gateway/channel/channel_output.hpp"
#include "gateway/channel/open_call.hpp"
#include "gateway/channel/released.hpp"
#include "gateway/channel/request_reader.hpp"
#include "gateway/policy.hpp"
#include "gateway/read_intervals.hpp"

namespace millrace::gateway::channel {

class Channel {
 public:
  /// `context` outlives the channel. `effects` is what all channels of this controller share.
  Channel(fabric::ChannelKey key, ChannelContext& context, ReadIntervals intervals = {},
          std::shared_ptr<WriteEffects> effects = std::make_shared<WriteEffects>());

  /// A call of an earlier run, from the journal; before the link comes up.
  void resume(CallRecord call, const Policy& policy);

  void on_link_up(Moment now);
  /// Sends nothing to the controller any more; on_link_down() or on_link_dropped() follows.
  void lose_link() { link_up_ = notified_ = false; }
  void on_link_down(const fabric::Message& reason, Moment now);
  /// The link was closed: pending reads and writes get no response.
  void on_link_dropped(const fabric::Message& reason, Moment now);
  void on_wake(Moment now);
  /// The controller now sends notifications, so polling is only a safeguard; or it does not. Reset
  /// by a new link.
  void set_notified(bool notified, Moment now);
  /// The controller notified a change of this variable: read now. The read finds what has changed.
  void on_change(Variable variable, Moment now);
  void on_read(const ServiceSnapshot& snapshot, Moment now);
  /// `reason` in words, with the code.
  void on_read_failed(const fabric::Message& reason, Moment now);
  void on_write(WriteOutcome outcome, const fabric::Message& reason, Moment now);
  void on_recorded(EntryNumber entry, Moment now);

  /// The news of all steps since the last call.
  ChannelNews take_news() { return out_.take_news(); }

  /// The request of ChannelNews::found.
  [[nodiscard]] const PendingRequest& found() const { return *found_; }
  /// It was skipped before, and its policy's waiting time for unserved requests is over.
  [[nodiscard]] bool deadline_passed() const { return unserved_.deadline_passed; }
  /// Accepts it with this id.
  void accept(fabric::CallId id, const Policy& policy, Moment now);
  /// Skips it; `reason` says why.
  void leave_unserved(const fabric::Message& reason, const Policy& policy, Moment now);
  /// Finds a skipped request again, because a new instance has appeared.
  void offer_again(Moment now);

  /// A new reader has appeared.
  void republish_status(Moment now) { publish_status(now); }

  // The progress of the call in OpenCall; without effect if there is none, or it is answered.
  void assign(const Assignment& assignment, Moment now);
  void suspend(const fabric::Message& reason, bool held, Moment now);
  void hold(const fabric::Message& reason, Moment now);
  void explain(const fabric::Message& reason, Moment now);
  void answer_locally(const LocalAnswer& answer, Moment now);
  void retry(const std::string& by, Moment now);
  /// A reply of an instance, to this call or to an earlier one.
  void on_reply(const fabric::Reply& reply, Moment now);

  /// The configuration or another gateway takes the channel away. Finishes the running call, or
  /// ends it at once, and accepts no new one; then is_over().
  void drain(Moment now);
  void hand_over(const fabric::Message& reason, Moment now);
  /// It is ours again, or still.
  void resume_ownership(Moment now);
  /// The gateway ends: another one may dispatch the running call if this one has not.
  void shut_down(Moment now);
  /// A call is under way, and an instance may have it, or have had it.
  [[nodiscard]] bool may_be_assigned() const { return call_ && call_->may_be_assigned(); }
  /// Nothing remains to do here, and nothing is on its way to the controller.
  [[nodiscard]] bool is_over() const { return draining_ && !has_work() && io_ == Io::none; }
  [[nodiscard]] bool draining() const { return draining_; }
  [[nodiscard]] bool link_up() const { return link_up_; }

  void set_intervals(const ReadIntervals& intervals) { intervals_ = intervals; }

  [[nodiscard]] const fabric::ChannelKey& key() const { return out_.key(); }
  /// The accepted call, or nullptr.
  [[nodiscard]] const CallRecord* call() const { return call_ ? &call_->call() : nullptr; }
  [[nodiscard]] const fabric::ChannelStatus& status() const { return out_.status(); }

 private:
  enum class Io { none, poll, answer, release };

  /// The skipped request; RequestReader has it.
  struct Unserved {
    fabric::Message reason;
    SteadyTime at{};
    Policy policy;
    /// It has waited for as long as its policy says.
    bool deadline_passed = false;
  };

  struct LateReplies {
    fabric::CallId call;
    std::vector<fabric::InstanceId> reported;
  };

  // channel.cpp: the channel and its reads
  void finish(Moment now);
  void advance(Moment now);
  void poll(const ServiceSnapshot& snapshot, Moment now);
  void poll_call(const ServiceSnapshot& snapshot, Moment now);
  /// The next read may show what another gateway has left.
  void expect_anything(Moment now);
  /// Whether the values in the channel may be the beginning of a request.
  [[nodiscard]] bool may_be_request(const ServiceSnapshot& snapshot, Moment now);
  /// The NC program may have withdrawn its request while RESPONSE_STATE was on its way, and have
  /// asked again. The late RESPONSE_STATE then released it from this call, and another response
  /// would answer its next request.
  [[nodiscard]] bool released_late(const ServiceSnapshot& snapshot, Moment now) const;
  void check_deadlines(Moment now);
  void read(ReadSet set, Io io, Moment now);
  void write(Variable variable, Value value, bool releases = false);
  [[nodiscard]] ReadSet poll_set(Moment now) const;
  [[nodiscard]] SteadyTime next_read(Moment now) const;
  [[nodiscard]] SteadyTime next_read_of_call(Moment now) const;
  void hold_off(const fabric::Message& reason, Moment now);
  /// Which write has no effect; empty while none is missed.
  /// Empty while there is none.
  [[nodiscard]] const fabric::Message& write_problem();
  void publish_status(Moment now);

  /// Has the call do something that may answer it.
  template <typename Act>
  void ask_call(Moment now, Act act) {
    const bool before = call_->answered();
    act(*call_);
    if (!before && call_->answered()) {
      // The answer's own read comes next; poll only if the journal keeps it waiting.
      due_ = now.steady + intervals_.idle;
    }
  }

  // channel_call.cpp: its call, and the one before it
  template <typename Act>
  void with_call(Moment now, Act act);
  void publish_seen(const CallRecord& call, Moment now);
  void late_reply(const fabric::Reply& reply, Moment now);
  void log_unassigned_reply(const fabric::Reply& reply, std::string_view what, Moment now);
  bool drive_writer(Moment now);
  void answer_read(const ServiceSnapshot& snapshot, Moment now);
  void report_writer();
  void writer_finished(Moment now);
  void release_written(WriteOutcome outcome, Moment now);
  /// True if the answer that was written last is in, and the channel idle or asked again.
  bool release_is_over(const ServiceSnapshot& snapshot, Moment now);
  void end(bool written, const fabric::Message& detail, Moment now);
  /// There is a call, or one whose end is not in the journal yet; or, for some seconds, one whose
  /// last write no read has shown: if that write is lost, no other gateway repeats it.
  [[nodiscard]] bool has_work() const {
    return call_ || (released_call_ && (released_call_->open ||
                                        (link_up_ && released_call_->answer.problem().empty())));
  }
  /// The channel is another gateway's, which finds the request there.
  [[nodiscard]] bool other_can_see(const ServiceSnapshot& snapshot, Moment now) const;
  void leave_to_the_other(Moment now);

  ReadIntervals intervals_;
  ChannelOutput out_;
  std::shared_ptr<WriteEffects> effects_;

  bool link_up_ = false;
  /// Since the link is up, a read has shown the channel without a request, or a call of ours has
  /// ended.
  bool zero_seen_ = false;
  /// Until when RESPONSE_STATE beside a request may be an answer whose REQUEST_STATE = 0 is not
  /// visible yet; nothing once that is known. And what stood there first.
  std::optional<SteadyTime> unknown_until_;
  std::optional<ServiceSnapshot> unknown_;
  /// RESPONSE_STATE of the last response, until a read shows it or it is lost. Where a read shows
  /// it together with a request, the request is not a new one.
  struct UnseenRelease {
    std::uint32_t state = 0;
    SteadyTime until{};
  };
  std::optional<UnseenRelease> unseen_release_;
  bool draining_ = false;
  /// The controller sends notifications.
  bool notified_ = false;
  /// Something changed while a read was under way, which may have come too early for it.
  bool read_again_ = false;
  /// Why another gateway has the channel; then a call is kept only if the other gateway cannot see
  /// it.
  fabric::Message handed_over_;
  /// The published status stays the call that was left to the other gateway, which must not
  /// dispatch it again.
  bool final_status_ = false;
  /// The last logged one.
  fabric::Message write_problem_;
  fabric::Message link_reason_ = base::messages::not_connected_yet();
  /// The controller's last error; empty while it responds.
  fabric::Message controller_error_;
  Io io_ = Io::none;
  SteadyTime due_{};
  /// The read that confirms a request comes no sooner after the one before it.
  SteadyTime confirm_at_{};
  SteadyTime not_before_{};
  SteadyTime active_until_{};
  SteadyTime whole_due_{};
  /// When the last read was asked for, and when its answer came.
  ReadTime read_time_{};
  /// When the last read of an answer's own came: others do not take in its request.
  SteadyTime answer_read_at_{};

  RequestReader reader_;
  std::optional<PendingRequest> found_;
  Unserved unserved_;
  std::optional<OpenCall> call_;
  /// The call that was answered last, until it is known that its program has gone on.
  struct ReleasedCall {
    Released answer;
    fabric::CallId call;
    /// The journal does not have its end yet.
    bool open = false;
    /// Its release is to be written once more.
    bool write_again = false;
  };
  std::optional<ReleasedCall> released_call_;
  std::optional<EndedCall> past_;
  /// The instances that the last call was dispatched to.
  std::vector<fabric::InstanceId> past_instances_;
  /// The late replies to the last answered call that were logged.
  LateReplies late_replies_;
  /// When the last reply from an instance without the call was logged.
  std::optional<SteadyTime> unassigned_logged_;
};

}  // namespace millrace::gateway::channel
