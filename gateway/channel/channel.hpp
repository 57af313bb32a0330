// The connection of one channel between its controller and the fabric: polls the channel, finds
// requests and writes responses. Pure: takes events and times; actions go to its ports
// (gateway/outputs.hpp), and the gateway gets its tasks from take_news().
// gateway/channel/open_call.hpp describes accepted calls.
//
//   Channel channel({"cnc", 1}, access, context);
//   channel.on_link_up(now);                  → read(ReadSet::state)
//   channel.on_read(snapshot, now);           → … → take_news().found
//   channel.accept(id, policy, now);          → publish(seen), publish(waiting)
//   channel.change_call(now, assign);         → append(Dispatched), then publish(request)
//   channel.on_reply(reply, now);             → append(Answered), read, write, write, read, write
//
// Its phase, whose type has what only it needs:
//
//   RequestReader ── a request ──► Found ── accept ──► OpenCall ── all is written ──► ReleasedCall
//      ▲   ▲                         │                    │                                │
//      │   └───── leave_unserved ────┘                    │ withdrawn, or handed over      │
//      └──────────────────────────────────────────────────┴───── its program went on ──────┘
//
// RequestReader also keeps the request that is unserved. The link (Link) and the ownership
// (Leaving) change in any phase: a call goes on without a controller, and is finished after the
// channel is another gateway's. A journal's call begins with OpenCall.
//
// A REQUEST_STATE is a new request only if a read has shown that the one before it is over, and a
// write counts only when a read has shown it (gateway/channel/answer_writer.hpp): a controller may
// apply writes any time after it has acknowledged them.
#pragma once

#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "base/messages/catalogue.hpp"
#include "gateway/channel/channel_output.hpp"
#include "gateway/channel/open_call.hpp"
#include "gateway/channel/request_reader.hpp"
#include "gateway/policy.hpp"
#include "gateway/read_intervals.hpp"

namespace millrace::gateway::channel {

class Channel {
 public:
  /// All outlive the channel. All channels of a controller share `controller`.
  Channel(fabric::ChannelKey key, ServiceAccess& access, ChannelContext& context,
          ControllerReads& controller);

  /// A call of an earlier run, from the journal; before the link comes up.
  void resume(CallRecord call, const Policy& policy);

  void on_link_up(Moment now);
  /// Sends nothing to the controller any more; on_link_down() or on_link_dropped() follows.
  void lose_link() { link_.up = reads_.notified = false; }
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
  [[nodiscard]] const PendingRequest& found() const { return std::get<Found>(phase_).request; }
  /// It was skipped before, and its policy's waiting time for unserved requests is over.
  [[nodiscard]] bool deadline_passed() const;
  /// Accepts it with this id.
  void accept(fabric::CallId id, const Policy& policy, Moment now);
  /// Skips it; `reason` says why.
  void leave_unserved(const fabric::Message& reason, const Policy& policy, Moment now);
  /// Finds a skipped request again, because a new instance has appeared.
  void offer_again(Moment now);

  /// A new reader has appeared.
  void republish_status(Moment now) { publish_status(now); }

  /// `act` changes the call, if there is one: assigns it, takes it back, answers it.
  template <typename Act>
  void change_call(Moment now, Act act) {
    if (OpenCall* const call = open_call()) {
      ask(*call, now, [&](OpenCall& open) { act(open, out_); });
    }
    finish(now);
  }
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
  [[nodiscard]] bool may_be_assigned() const {
    const OpenCall* const call = open_call();
    return call && call->may_be_assigned();
  }
  /// Nothing remains to do here, and nothing is on its way to the controller.
  [[nodiscard]] bool is_over() const {
    return leaving_ && !has_work() && io_.purpose == Purpose::none;
  }
  [[nodiscard]] bool draining() const { return leaving_.has_value(); }
  [[nodiscard]] bool linked() const { return link_.up; }

  [[nodiscard]] const fabric::ChannelKey& key() const { return out_.key(); }
  /// The accepted call, or nullptr.
  [[nodiscard]] std::shared_ptr<const CallRecord> call() const {
    const OpenCall* const call = open_call();
    return call ? call->call() : nullptr;
  }
  [[nodiscard]] const fabric::ChannelStatus& status() const { return out_.status(); }

 private:
  /// A request that was found: accept() or leave_unserved() comes before anything else.
  struct Found {
    RequestReader reader;
    PendingRequest request;
  };
  /// The answered call, until it is known that its program has gone on.
  struct ReleasedCall {
    Released answer;
    std::shared_ptr<const CallRecord> call;
    /// The journal does not have its end yet.
    bool open = false;
    /// Its release is to be written once more.
    bool write_again = false;
  };
  using Phase = std::variant<RequestReader, Found, OpenCall, ReleasedCall>;

  struct Link {
    bool up = false;
    /// Why it is not.
    fabric::Message down_reason = base::messages::not_connected_yet();
    /// The controller's last error; empty while it responds.
    fabric::Message error{};
    /// Since it is up, a read has shown the channel without a request, or a call of ours has ended.
    bool zero_seen = false;
    /// Until then a write may take effect that another gateway, or an earlier run of this one, has
    /// sent for the request that stands in the channel (LATE).
    SteadyTime strange_writes_until{};
  };

  enum class Purpose : std::uint8_t { none, poll, answer, release };
  /// The read or write under way.
  struct Io {
    Purpose purpose = Purpose::none;
    /// When the last read was asked for, and when its answer came.
    ReadTime read{};
    /// When the last read of an answer's own came: others do not take in its request.
    SteadyTime answer_read{};
    /// Something changed while a read was under way, which may have come too early for it.
    bool read_again = false;
  };

  /// When the channel is read.
  struct Schedule {
    /// The controller sends notifications.
    bool notified = false;
    SteadyTime due{};
    /// The read that confirms a request comes no sooner after the one before it.
    SteadyTime confirm_at{};
    /// The controller has refused something.
    SteadyTime not_before{};
    /// A program's next request is likely.
    SteadyTime active_until{};
    /// Of a read of a request's texts too.
    SteadyTime whole_due{};
  };

  /// What the channel may still show of an earlier answer.
  struct Earlier {
    /// Until when RESPONSE_STATE beside a request may be an answer whose REQUEST_STATE = 0 is not
    /// visible yet; nothing once that is known. And what stood there first.
    std::optional<SteadyTime> until{};
    std::optional<ServiceSnapshot> first{};
    /// RESPONSE_STATE of the last response, until a read shows it or it is lost. Where a read shows
    /// it together with a request, the request is not a new one.
    struct Release {
      std::uint32_t state = 0;
      SteadyTime until{};
    };
    std::optional<Release> release{};
  };

  /// The channel is given up. No new call is accepted.
  struct Leaving {
    /// Why another gateway has it; then a call is kept only if the other gateway cannot see it.
    /// Empty if it was only removed from the configuration.
    fabric::Message handed_over{};
    /// The published status stays the call that was left to the other gateway, which must not
    /// dispatch it again.
    bool final_status = false;
  };

  /// For replies to the call that ended last.
  struct Past {
    std::optional<EndedCall> call{};
    /// The instances whose late replies to `reported_call` were logged.
    fabric::CallId reported_call{};
    std::vector<fabric::InstanceId> reported{};
    /// When the last reply from an instance without the call was logged.
    std::optional<SteadyTime> unassigned_logged{};
  };

  [[nodiscard]] const ReadIntervals& intervals() const { return controller_.intervals; }
  [[nodiscard]] SteadyTime next_read(Moment now) const;
  [[nodiscard]] SteadyTime next_read_of_call(Moment now) const;

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
  void read(ReadSet set, Purpose purpose, Moment now);
  void write(const Write& write, Moment now);
  [[nodiscard]] ReadSet poll_set(Moment now) const;
  void hold_off(const fabric::Message& reason, Moment now);
  /// Which write has no effect; empty while none is missed.
  [[nodiscard]] const fabric::Message& write_problem();
  void publish_status(Moment now);

  /// Has the call do something that may answer it.
  template <typename Act>
  void ask(OpenCall& call, Moment now, Act act) {
    const bool before = call.answered();
    act(call);
    if (!before && call.answered()) {
      // The answer's own read comes next; poll only if the journal keeps it waiting.
      reads_.due = now.steady + intervals().idle;
    }
  }

  // channel_call.cpp: its call, and the one before it
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
  /// There is a call, or one whose end is not in the journal yet.
  [[nodiscard]] bool has_call() const;
  /// Or, for some seconds, one whose last write no read has shown: if that write is lost, no other
  /// gateway repeats it.
  [[nodiscard]] bool has_work() const;
  /// The channel is another gateway's, which finds the request there.
  [[nodiscard]] bool other_can_see(const ServiceSnapshot& snapshot, Moment now) const;
  void leave_to_the_other(Moment now);

  [[nodiscard]] RequestReader* reader() { return std::get_if<RequestReader>(&phase_); }
  [[nodiscard]] OpenCall* open_call() { return std::get_if<OpenCall>(&phase_); }
  [[nodiscard]] const OpenCall* open_call() const { return std::get_if<OpenCall>(&phase_); }
  [[nodiscard]] ReleasedCall* released() { return std::get_if<ReleasedCall>(&phase_); }
  /// The response that is being written, or nullptr.
  [[nodiscard]] AnswerWriter* writer() {
    OpenCall* const call = open_call();
    return call != nullptr ? call->writer() : nullptr;
  }

  ChannelOutput out_;
  ControllerReads& controller_;
  Phase phase_;
  Link link_;
  Io io_;
  Schedule reads_;
  Earlier earlier_;
  std::optional<Leaving> leaving_;
  Past past_;
};

}  // namespace millrace::gateway::channel
