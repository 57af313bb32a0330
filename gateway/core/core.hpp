// The gateway without its sockets: the Service Interfaces of all channels, machines and message
// queues, the dispatch of calls, and their connection to the ports. Pure decisions.
//
//   Core core(fabric, host, {own, lease, machines, policies}, journal_state);
//   core.start();                                     → host.connect(…)
//   core.on_link_up("cnc", {1, 2});                   → the link's read(…)
//   core.on_read({"cnc", 1}, snapshot);
//
// Each public function that is not `const` is an input: an event at the time of Host::now() when it
// begins. It first detects whether this gateway stood still: others may have taken over its
// machines, so links may be closed before the event itself is handled. At its end it performs the
// remaining actions and requests the next wake-up.
#pragma once

#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include <tl/expected.hpp>

#include "fabric/request_key.hpp"
#include "gateway/core/call_numbers.hpp"
#include "gateway/core/channel_table.hpp"
#include "gateway/core/machines.hpp"
#include "gateway/core/message_queues.hpp"
#include "gateway/core/ports.hpp"
#include "gateway/core/predecessor_calls.hpp"
#include "gateway/dispatch/dispatcher.hpp"
#include "gateway/journal/journal_state.hpp"
#include "gateway/machines/stall_detector.hpp"

namespace millrace::gateway::core {

struct CoreOptions {
  GatewayIdentity own{};
  /// How long other gateways wait for a silent one.
  std::chrono::nanoseconds lease{};
  std::vector<settings::MachineSettings> machines{};
  Policies policies{};
  /// While it can be written.
  fabric::JournalState journal = fabric::JournalState::kept;
};

/// The result of an operator's command.
struct CommandResult {
  bool done = false;
  fabric::Message detail;
};

/// The response that an operator gives to an NC program.
struct OperatorAnswer {
  std::string text;
  std::uint32_t state = 0;
  /// For people: "operator@host".
  std::string by;
};

class Core : public machines::ControllerEvents, protected MachinesListener {
 public:
  /// Fabric and Host outlive this, and so does `journal_state`, what the journal adds up to.
  Core(Fabric& fabric, Host& host, CoreOptions options, const journal::JournalState& journal_state);

  void start();
  /// The configuration has changed: new policies are for calls that are accepted from now on.
  void change(std::vector<settings::MachineSettings> machines, Policies policies);
  /// No call is accepted any more; then Host::may_end().
  void stop();
  /// The last input: withdraws answered requests, and publishes which calls were never dispatched.
  void end();

  void on_time();
  /// Publishes that the gateway runs, now and again at the returned time.
  SteadyTime heartbeat();
  /// About once a second: publishes the load of links and queues.
  void publish_load();
  /// Any other event begins: detects whether this gateway stood still.
  void on_other_event();

  // Events of the links.
  void on_link_up(const std::string& machine, const machines::Channels& channels) override;
  void on_link_down(const std::string& machine, const machines::LinkLoss& loss) override;
  void on_read(const fabric::ChannelKey& key, const ServiceSnapshot& snapshot) override;
  void on_read_failed(const fabric::ChannelKey& key, const fabric::Message& reason) override;
  void on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                const fabric::Message& reason) override;
  void on_subscribed(const std::string& machine,
                     const std::vector<machines::SubscribeOutcome>& outcomes) override;
  void on_notification(const fabric::ChannelKey& key, Variable variable,
                       std::optional<std::uint32_t> value) override;
  void on_answer(const std::string& machine, const machines::Answer& answer) override;
  void on_queue_answer(const fabric::ChannelKey& queue, queues::StepAnswer answer) override;
  void on_queue_event(const fabric::ChannelKey& queue) override;

  // Events of the journal.
  void on_recorded(const Ticket& ticket);
  /// The journal cannot be written, and why; empty = it can again. No call is accepted while it
  /// cannot, and waiting ones show the reason.
  void on_journal_error(const fabric::Message& error);

  // Events of the fabric.
  void on_instance_ready(const fabric::InstanceIdentity& instance);
  void on_instance_gone(const fabric::InstanceId& instance);
  void on_load(const fabric::InstanceLoad& load);
  /// A reply for a channel that no machine of ours has belongs to another gateway.
  void on_reply(const fabric::Reply& reply);
  /// The present readers. A new reader gets everything that has changed since it was last
  /// published.
  void set_readers(const Readers& readers);
  /// Samples of other gateways.
  void on_machine(const fabric::MachineStatus& status);
  void on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway);
  void on_channel(const fabric::ChannelStatus& status);
  /// Left to other gateways if the channel is not ours.
  void on_variable_request(const fabric::VariableRequest& request);

  // An operator's command: answer a channel's call, or dispatch it again. `call` must still be
  // pending, and the response be one that a channel can take. core_commands.cpp.
  CommandResult on_answer(const fabric::ChannelKey& key, const fabric::CallId& call,
                          const OperatorAnswer& answer);
  CommandResult on_retry(const fabric::ChannelKey& key, const fabric::CallId& call,
                         const std::string& by);

  [[nodiscard]] bool serves(const fabric::ChannelKey& key) const {
    return channels_.find(key) != nullptr;
  }
  [[nodiscard]] CallCounts counts() const { return channels_.counts(); }

 protected:
  // Events of machines; core_channels.cpp. The simulation observes machines and the calls of
  // message queues through these functions.
  void on_serve(const std::string& machine, const machines::Channels& channels) override;
  void on_lost(const std::string& machine, const fabric::Message& reason) override;
  void on_link_dropped(const std::string& machine, const fabric::Message& reason) override;
  void on_channel_removed(const fabric::ChannelKey& key) override;
  void on_not_owner(const fabric::ChannelKey& key, const fabric::Message& reason) override;
  void on_predecessor_call(const fabric::ChannelStatus& status, const std::string& from) override;
  void on_trusted(const fabric::ChannelKey& key, bool trusted) override;
  void on_change(const fabric::ChannelKey& key, Variable variable) override;
  [[nodiscard]] machines::Channels channels_of(const std::string& machine) const override {
    return channels_.of(machine);
  }
  virtual ServiceAccess& access_of(const fabric::ChannelKey& key);
  virtual void read_channel(const fabric::ChannelKey& key, const ServiceSnapshot& snapshot);
  [[nodiscard]] ServiceSnapshot queue_snapshot(const fabric::ChannelKey& key) const {
    return queues_.snapshot(key, ReadSet::all);
  }

 private:
  /// What each input begins and ends with.
  void enter();
  void finish();
  template <typename Act>
  auto input(Act act) {
    enter();
    if constexpr (std::is_void_v<decltype(act())>) {
      act();
      finish();
    } else {
      auto result = act();
      finish();
      return result;
    }
  }
  [[nodiscard]] std::optional<SteadyTime> next_time() const;
  /// When something is due with a channel or a call.
  [[nodiscard]] std::optional<SteadyTime> next_time_of_calls() const;
  void on_time_of_calls();

  // Which channels there are; core_channels.cpp.
  channel::Channel& open(const fabric::ChannelKey& key) {
    return channels_.open(key, access_of(key), context_);
  }
  /// These are served, and those that are leaving are brought to their end.
  void serve(const std::string& machine, const machines::Channels& channels);
  void take_down(const std::string& machine, const fabric::Message& reason);
  template <typename End>
  void lose_link(const std::string& machine, End end);
  void drain(const fabric::ChannelKey& key);
  void remember(const fabric::ChannelKey& key, PredecessorCall call);
  /// Ends channels that are drained or handed over once nothing is left to do there.
  void remove_drained_channels();
  void dispose(const std::vector<fabric::RequestKey>& requests);
  /// Passes the events of message queues to their channels; false if there are none.
  bool deliver_queue_events();

  // What the steps of a channel mean for calls; core_requests.cpp.
  /// Without effect if the core does not have the channel any more.
  template <typename Step>
  void step(const fabric::ChannelKey& key, Step step) {
    if (channel::Channel* channel = channels_.find(key)) {
      step(*channel);
      follow(*channel);
    }
    remove_drained_channels();
  }
  template <typename Step>
  void step_all(Step step) {
    for (auto& [key, channel] : channels_) {
      step(channel);
      follow(channel);
    }
  }
  /// Performs the actions of the channel's last steps.
  void follow(channel::Channel& channel);
  void apply(const dispatch::Decisions& decisions);
  template <typename Act>
  void change_call(channel::Channel& channel, Act act) {
    channel.change_call(now_, act);
    follow(channel);
  }
  /// The channel has found a request.
  void admit(channel::Channel& channel);
  bool hold_for_predecessor(channel::Channel& channel, const std::string& canonical_uuid,
                            const Policy& policy);
  /// Skipped requests may now have another reason, or none.
  void offer_again() {
    step_all([&](channel::Channel& channel) { channel.offer_again(now_); });
  }
  [[nodiscard]] Policy policy_of(const fabric::ChannelKey& key,
                                 const std::string& canonical_uuid) const;
  fabric::CallId next_id();
  void reserve_numbers();

  /// The error is for the operator.
  tl::expected<channel::Channel*, fabric::Message> find_pending(const fabric::ChannelKey& key,
                                                                const fabric::CallId& call);

  /// The present input, or the last one.
  struct Input {
    bool at_work = false;
    machines::StallDetector stall;
    /// The last wake-up time that was requested.
    std::optional<SteadyTime> wakes_at{};
  };
  /// What decides whether a found request becomes a call.
  struct Admission {
    CallNumbers numbers;
    PredecessorCalls predecessors{};
    /// Why no call is accepted; empty while calls are.
    fabric::Message stopped{};
  };
  /// The gateway is to end.
  struct Ending {
    SteadyTime at_latest;
    /// Host::may_end() was called.
    bool announced = false;
  };

  Host& host_;
  CoreOptions options_;
  const journal::JournalState& journal_state_;
  Moment now_;
  Input input_;
  dispatch::Dispatcher dispatcher_;
  /// Before the channels, which refer to it.
  channel::ChannelContext context_;
  ChannelTable channels_;
  Admission admission_;
  MessageQueues queues_;
  Machines machines_;
  std::optional<Ending> ending_;
};

}  // namespace millrace::gateway::core
