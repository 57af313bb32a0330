// The configured machines: connects to each, serves the channels that no other gateway serves,
// requests their other values, and publishes the state of its links. Pure.
//
//   Machines machines(own, fabric, host, listener);
//   machines.set(settings.machines, now);             // again when the configuration changes
//   machines.on_time(now);                            // once machines.next_time() has come
//   → host.connect(…), listener.on_serve("cnc", {1, 2}), fabric.publish(status)
//
// Of two gateways that claim a channel, the one that claimed it first serves it. The other one does
// not even connect if all its channels are taken (a controller keeps one connection for each host),
// and takes over when the first one is gone. To let two gateways that start together discover each
// other, each waits for a moment before it serves.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "fabric/log_limiter.hpp"
#include "fabric/messages.hpp"
#include "gateway/core/machine_values.hpp"
#include "gateway/core/ports.hpp"
#include "gateway/machines/claims.hpp"
#include "gateway/machines/machine_status_writer.hpp"
#include "gateway/moment.hpp"
#include "gateway/settings/settings.hpp"

namespace millrace::gateway::core {

using machines::Channels;

/// How a gateway identifies itself.
struct GatewayIdentity {
  fabric::InstanceId id{};
  std::string host{};
  std::uint32_t pid = 0;
  std::string version{};
  /// Of its journal, which its calls carry.
  std::uint64_t epoch = 0;
};

/// Events of channels. It may call channels_of() and nothing else from within.
class MachinesListener {
 public:
  virtual ~MachinesListener() = default;
  /// The link is up and these channels are ours; again when their number changes.
  virtual void on_serve(const std::string& machine, const Channels& channels) = 0;
  /// Every read and write is answered before the link comes up again.
  virtual void on_lost(const std::string& machine, const fabric::Message& reason) = 0;
  /// The link was taken away: reads and writes under way are not answered any more.
  virtual void on_link_dropped(const std::string& machine, const fabric::Message& reason) = 0;
  /// The channel was removed from the configuration.
  virtual void on_channel_removed(const fabric::ChannelKey& key) = 0;
  /// Another gateway serves the channel.
  virtual void on_not_owner(const fabric::ChannelKey& key, const fabric::Message& reason) = 0;
  /// We serve the channel from now on, after a gateway that is gone and left this status.
  virtual void on_predecessor_call(const fabric::ChannelStatus& status,
                                   const std::string& from) = 0;
  /// Whether the controller sends reliable notifications for the channel from now on; false when
  /// the link comes up.
  virtual void on_trusted(const fabric::ChannelKey& key, bool trusted) = 0;
  /// A value has changed there: read now.
  virtual void on_change(const fabric::ChannelKey& key, Variable variable) = 0;
  /// Channels of this machine that have a channel.
  [[nodiscard]] virtual Channels channels_of(const std::string& machine) const = 0;
};

class Machines : public ServiceAccess {
 public:
  /// All must outlive this.
  Machines(GatewayIdentity own, Fabric& fabric, Host& host, MachinesListener& listener)
      : own_(std::move(own)), fabric_(fabric), host_(host), listener_(listener), claims_(own_.id) {}
  Machines(const Machines&) = delete;
  Machines& operator=(const Machines&) = delete;

  /// The machines to serve from now on. A removed one is served until its running calls are
  /// answered. One with a new address or other channels is connected again.
  void set(const std::vector<settings::MachineSettings>& machines, Moment now);

  /// Samples of other gateways.
  void on_machine(const fabric::MachineStatus& status, Moment now);
  void on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway, Moment now);
  void on_channel(const fabric::ChannelStatus& status, Moment now);

  // Events of the links, also of one that was closed a moment ago.
  void on_link_up(const std::string& machine, const Channels& channels, Moment now);
  void on_link_down(const std::string& machine, const machines::LinkLoss& loss, Moment now);
  /// Called before any other part sees the read.
  void on_read(const fabric::ChannelKey& key, const ServiceSnapshot& snapshot, Moment now);
  void on_subscribed(const std::string& machine,
                     const std::vector<machines::SubscribeOutcome>& outcomes, Moment now);
  void on_notification(const fabric::ChannelKey& key, Variable variable,
                       std::optional<std::uint32_t> value, Moment now);
  /// The response to a request for its values.
  void on_answer(const std::string& machine, const machines::Answer& answer, Moment now);
  /// False if the link was closed: its later events are ignored.
  [[nodiscard]] bool linked(const std::string& machine) const {
    return machines_.at(machine).connected() != nullptr;
  }

  /// A channel that was removed, or is another gateway's, is over.
  void on_over(const fabric::ChannelKey& key) override { reviews_.insert(key.machine); }
  /// This process stood still for longer than other gateways wait: it gives up the machines that
  /// another one may have taken over, until their owners are known. False if there are none. All
  /// machines are published again, since readers that took this gateway for gone have dropped them.
  bool on_stall(Moment now);
  /// Of this gateway, said with each machine.
  void set_journal(fabric::JournalState state);
  /// About once a second: publishes the load of the links.
  void publish_load(Moment now);

  void read(const fabric::ChannelKey& key, ReadSet set) override;
  void write(const fabric::ChannelKey& key, const Write& write, Moment now) override;
  /// The link has answered a read or write of a call.
  void on_call_answered(const std::string& machine, Moment now);
  /// A request for variables. Left to other gateways if the channel is not ours.
  void on_request(const fabric::VariableRequest& request, Moment now);
  /// Null if it was taken away, or the machine is not ours.
  [[nodiscard]] machines::Controller* link_of(const std::string& machine) const;

  /// The end of each event: performs its remaining actions.
  void finish(Moment now);
  /// And this, at its very end: asks for values while no call is under way.
  void ask_values(Moment now);
  void on_time(Moment now);
  /// When on_time() or ask_values() has something to do, or before.
  [[nodiscard]] std::optional<SteadyTime> next_time() const;

 private:
  /// One machine of the configuration.
  struct Machine {
    Machine(const settings::MachineSettings& of, machines::MachineStatusWriter writer,
            MachineValues asked)
        : settings(of),
          status_writer(std::move(writer)),
          subscriptions(of.watch),
          values(std::move(asked)) {}

    /// First it is found out whether other gateways serve it.
    struct Listening {
      SteadyTime since;
      SteadyTime until;
    };
    /// All its channels belong to another gateway, so the gateway does not connect.
    struct StandingBy {};
    struct Connected {
      std::unique_ptr<machines::Controller> link;
      /// Reads and writes of calls that the link has not answered.
      std::size_t calls_under_way = 0;
      /// Since when there are none.
      SteadyTime rests_since{};
      /// The channels that the controller has; nothing while it does not answer.
      std::optional<Channels> found{};
      /// Those that are ours.
      std::set<std::uint16_t> served{};
    };

    [[nodiscard]] Listening* listening() { return std::get_if<Listening>(&phase); }
    [[nodiscard]] Connected* connected() { return std::get_if<Connected>(&phase); }
    [[nodiscard]] const Connected* connected() const { return std::get_if<Connected>(&phase); }
    [[nodiscard]] bool serves(std::uint16_t channel) const {
      return connected() != nullptr && connected()->served.contains(channel);
    }

    settings::MachineSettings settings;
    machines::MachineStatusWriter status_writer;
    std::variant<StandingBy, Listening, Connected> phase{};
    /// It may have served already; then its claim is not moved behind those of others.
    bool has_served = false;
    /// It was removed from the configuration.
    bool removed = false;
    /// The gateway that serves it instead, as logged last.
    fabric::Message refusal{};
    /// What is missing although it is up: channels of other gateways.
    fabric::Message note{};
    machines::Subscriptions subscriptions;
    MachineValues values;
  };

  /// What another gateway has published about a channel.
  struct OtherStatus {
    fabric::ChannelStatus status;
    /// This gateway owns the channel since then, and has taken the call into account.
    bool accounted = false;
  };

  /// Of other gateways.
  struct Others {
    /// The last status of channels of contested machines, while others served them.
    std::map<fabric::ChannelKey, OtherStatus> channels;
    /// The gateway that left each machine last.
    std::map<std::string, std::string> predecessors;
  };
  /// When values of a machine are to be asked for.
  struct ValuesDue {
    /// They have changed, or wait for calls; most events leave them alone.
    bool now = false;
    std::optional<SteadyTime> at{};
  };

  Machine* find_linked(const std::string& machine);
  /// To change them: then ask_values() looks at all machines.
  MachineValues& values_of(Machine& machine);
  Machine& add(const settings::MachineSettings& settings, Moment now);
  void change(Machine& machine, const settings::MachineSettings& settings, Moment now);
  /// Another gateway's sample of a machine; false if it does not affect ours.
  bool note_claim(const fabric::MachineStatus& status, Moment now);
  void warn_limited(const std::string& kind, const std::string& about, const std::string& text,
                    Moment now);
  void listen(Machine& machine, Moment now);
  void listened(Machine& machine, Moment now);
  void review(const std::string& machine, Moment now);
  bool owned_by_others(Machine& machine, Moment now);
  /// Of a machine that is up.
  void serve(Machine& machine, Moment now);
  void connect(Machine& machine, Moment now);
  void drop_link(Machine& machine, const fabric::Message& reason, Moment now);
  void remove(Machine& machine, std::uint16_t channel, Moment now);
  void not_owner(Machine& machine, std::uint16_t channel, const fabric::Message& reason,
                 Moment now);
  void on_predecessor_call(const fabric::ChannelKey& key);
  /// Another gateway may serve the channel from now on, also with a call that it had before.
  /// Without a channel: each of the machine.
  void forget_accounted(const std::string& machine, std::optional<std::uint16_t> channel = {});
  void publish(Machine& machine);
  void apply(Machine& machine, const machines::SubscriptionActions& actions, Moment now);
  static void write_up(Machine& machine, std::size_t channels, Moment now);
  void wake_at(std::optional<SteadyTime> time);

  GatewayIdentity own_;
  fabric::JournalState journal_ = fabric::JournalState::kept;
  Fabric& fabric_;
  Host& host_;
  MachinesListener& listener_;
  machines::Claims claims_;
  std::map<std::string, Machine> machines_;
  ValuesDue values_due_;
  /// Machines to review once the current event is over.
  std::set<std::string> reviews_;
  /// No earlier time is due.
  std::optional<SteadyTime> next_;
  /// A warning that a stranger can cause ten thousand times a second is logged once.
  fabric::LogLimiter log_limiter_;
  Others others_;
};

}  // namespace millrace::gateway::core
