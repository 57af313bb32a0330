// The gateway without its sockets: the sessions of all channels, the dispatcher, and who tells
// whom. Pure: takes events and times; what is to be done outside goes out through the port.
//
//   CallControl control(port, options, ledger);
//   control.on_link_up("cnc", {1, 2}, now);                  // port.read(…) for each channel
//   control.on_read({"cnc", 1}, snapshot, now);
//   control.on_instance_ready(identity, now);
//   arm_timer(control.next_time());                          // then control.on_time(now)
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include <tl/expected.hpp>

#include "fabric/channel_key_hash.hpp"
#include "gateway/channel/session.hpp"
#include "gateway/control/timers.hpp"
#include "gateway/dispatch/dispatcher.hpp"
#include "gateway/journal/ledger.hpp"

namespace millrace::gateway::control {

struct CallControlOptions {
  /// By machine; one that is not here is looked at with the default pace.
  std::map<std::string, Pace> paces{};
  dispatch::DispatcherOptions dispatcher{};
  Policies policies{};
};

/// What became of an operator's command.
struct Verdict {
  bool done = false;
  std::string detail;
};

/// What another gateway had done with a channel's request when it was gone.
struct Inheritance {
  std::string uuid;
  /// The other gateway, for people.
  std::string from;
  fabric::CallId call{};
  /// A look at the channel has been asked for since. One that was asked for before may show the
  /// channel as it was before that request.
  bool looked_since = false;
};

/// What an operator wants a program to get.
struct OperatorAnswer {
  std::string text;
  std::uint32_t state = 0;
  /// For people: "operator@host".
  std::string by;
};

/// What became of the calls of all channels since the start.
struct CallCounts {
  std::uint64_t answered = 0;
  /// With an error in the service's place.
  std::uint64_t failed = 0;
  std::uint64_t withdrawn = 0;
};

class CallControl {
 public:
  /// `port` outlives this. `ledger` is what the journal adds up to; its numbers must have an epoch.
  CallControl(Outputs& port, CallControlOptions options, const journal::Ledger& ledger);
  CallControl(const CallControl&) = delete;
  CallControl& operator=(const CallControl&) = delete;

  /// The controller answers; these are the channels to serve, and those that are leaving. Again
  /// when there are more to serve.
  void on_link_up(const std::string& machine, const std::vector<std::uint16_t>& channels,
                  Moment now);
  void on_link_down(const std::string& machine, const std::string& reason, Moment now);

  /// The link was taken away: what was asked of it is not answered any more.
  void on_link_dropped(const std::string& machine, const std::string& reason, Moment now);

  /// The channel is not in the configuration any more: its call under way is finished first.
  void retire(const fabric::ChannelKey& key, Moment now);
  /// Another gateway serves the channel: its call under way is the other's now.
  void release(const fabric::ChannelKey& key, const std::string& reason, Moment now);
  /// The other gateway is gone, and this is what it has left in the channel.
  void inherit(const fabric::ChannelKey& key, Inheritance inheritance);
  /// The channels of a machine that have a session, also those that are leaving.
  [[nodiscard]] std::vector<std::uint16_t> channels_of(const std::string& machine) const;
  [[nodiscard]] CallCounts counts() const;
  /// New paces at once, new policies for calls that are claimed from now on.
  void change(std::map<std::string, Pace> paces, Policies policies, Moment now);

  /// Whether the controller tells of changes in the channel; and that it has.
  void set_told(const fabric::ChannelKey& key, bool told, Moment now);
  void on_change(const fabric::ChannelKey& key, Variable variable, Moment now);
  void on_read(const fabric::ChannelKey& key, const Snapshot& snapshot, Moment now);
  void on_read_failed(const fabric::ChannelKey& key, const std::string& reason, Moment now);
  void on_write(const fabric::ChannelKey& key, WriteOutcome outcome, const std::string& reason,
                Moment now);
  void on_recorded(const Ticket& ticket, Moment now);

  void on_instance_ready(const fabric::InstanceIdentity& identity, Moment now);
  void on_instance_gone(const fabric::InstanceId& instance, Moment now);
  void on_load(const fabric::InstanceLoad& load, Moment now);
  void on_reply(const fabric::Reply& reply, Moment now);

  /// An operator answers a channel's call, or has it given out again. `call` must still be pending,
  /// and the answer be one that a channel can take.
  Verdict on_answer(const fabric::ChannelKey& key, const fabric::CallId& call,
                    const OperatorAnswer& answer, Moment now);
  Verdict on_retry(const fabric::ChannelKey& key, const fabric::CallId& call, const std::string& by,
                   Moment now);
  [[nodiscard]] bool serves(const fabric::ChannelKey& key) const { return sessions_.contains(key); }

  /// Why no new call may be claimed; empty = claim again.
  void set_obstacle(const std::string& reason, Moment now);
  /// The journal cannot be written, and why; empty = it can again. No new call is claimed
  /// meanwhile, and those that wait for it say so.
  void set_journal_trouble(const std::string& reason, Moment now);

  /// Who listens from now on. Who begins to look is shown what is not as it was shown last.
  void set_interest(const Interest& interest, Moment now);

  /// Before the gateway ends: takes back what is answered, and says which calls it never gave out.
  void take_back(Moment now);

  /// An answer is on its way into a channel.
  [[nodiscard]] bool answering() const;

  void on_time(Moment now);
  /// When on_time has something to do.
  [[nodiscard]] std::optional<SteadyTime> next_time() const;

 private:
  channel::ChannelSession* find(const fabric::ChannelKey& key);
  channel::ChannelSession& open(const fabric::ChannelKey& key);
  /// Nothing if the channel has no session any more.
  template <typename Step>
  void step(const fabric::ChannelKey& key, Moment now, Step step);
  [[nodiscard]] Pace pace_of(const std::string& machine) const;
  void lose_link(const std::string& machine);
  /// Does what the session's last steps ask for.
  void follow(channel::ChannelSession& session, Moment now);
  void dispose(const std::vector<fabric::RequestKey>& requests);
  void forget_inherited(const fabric::ChannelKey& key, const fabric::CallId& call);
  /// A look at the channel is asked for.
  void look_at_inherited(const fabric::ChannelKey& key);
  /// A look has shown that what was inherited before it is over.
  void forget_looked_at(const fabric::ChannelKey& key);
  bool hold_inherited(channel::ChannelSession& session, const std::string& canonical_uuid,
                      const Policy& policy, Moment now);
  void carry_out(const dispatch::Decisions& decisions, Moment now);
  void answer_found(channel::ChannelSession& session, Moment now);
  /// The error is for the operator.
  tl::expected<channel::ChannelSession*, std::string> find_pending(const fabric::ChannelKey& key,
                                                                   const fabric::CallId& call);
  [[nodiscard]] Policy policy_of(const fabric::ChannelKey& key,
                                 const std::string& canonical_uuid) const;
  void reconsider(Moment now);
  fabric::CallId next_id();
  void reserve_numbers();
  void finish();

  CallControlOptions options_;
  dispatch::Dispatcher dispatcher_;
  /// Before the sessions, which refer to it.
  channel::ChannelContext context_;
  std::map<std::string, std::shared_ptr<WriteEffects>> effects_;
  std::map<fabric::ChannelKey, channel::ChannelSession> sessions_;
  /// The same, to find one quickly.
  std::unordered_map<fabric::ChannelKey, channel::ChannelSession*, fabric::ChannelKeyHash> index_;
  /// Sessions that are retired or released, until they are over.
  std::set<fabric::ChannelKey> leaving_;
  /// Of channels that have left.
  CallCounts left_counts_;
  /// By canonical UUID: with two gateways that lose each other more than one may be left.
  std::map<fabric::ChannelKey, std::map<std::string, Inheritance>> inherited_;
  Timers timers_;
  std::string obstacle_;
  std::uint64_t epoch_ = 0;
  /// The last number given; numbers up to `recorded_` may be used, the journal was asked for those
  /// up to `reserved_`.
  std::uint64_t last_number_ = 0;
  std::uint64_t recorded_ = 0;
  std::uint64_t reserved_ = 0;
  /// A request was left because no number was there.
  bool out_of_numbers_ = false;
};

}  // namespace millrace::gateway::control
