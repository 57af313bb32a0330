// The machines a gateway is set up for: connects to each, serves the channels that no other gateway
// serves, asks for what else is wanted of them, and tells the fabric how its links are. Pure.
//
//   Machines machines(own, fabric, host, listener);
//   machines.set(settings.machines, now);             // again when the configuration changes
//   machines.on_time(now);                            // once machines.next_time() has come
//   → host.connect(…), listener.on_serve("cnc", {1, 2}), fabric.publish(status)
//
// Of two gateways that claim a channel the one that claimed it first serves it. The other does not
// even connect if all its channels are taken (a controller keeps one connection for each host), and
// takes over when the first is gone. So that two that start together see each other first, each
// listens for a moment before it serves.
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

/// What a gateway tells of itself.
struct GatewayIdentity {
  fabric::InstanceId id{};
  std::string host{};
  std::uint32_t pid = 0;
  std::string version{};
  /// Of its journal, which its calls carry.
  std::uint64_t epoch = 0;
};

/// What becomes of channels. May ask channels_of(), and calls nothing else back from within.
class MachinesListener {
 public:
  virtual ~MachinesListener() = default;
  /// The link is up and these channels are ours; again when their number changes meanwhile.
  virtual void on_serve(const std::string& machine, const Channels& channels) = 0;
  /// Every read and write is answered before the link comes up again.
  virtual void on_lost(const std::string& machine, const std::string& reason) = 0;
  /// The link was taken away: reads and writes under way are not answered any more.
  virtual void on_link_dropped(const std::string& machine, const std::string& reason) = 0;
  /// The configuration names the channel no more.
  virtual void on_channel_removed(const fabric::ChannelKey& key) = 0;
  /// Another gateway serves the channel.
  virtual void on_not_owner(const fabric::ChannelKey& key, const std::string& reason) = 0;
  /// We serve the channel from now on, in the place of a gateway that is gone and left this status.
  virtual void on_predecessor_call(const fabric::ChannelStatus& status,
                                   const std::string& from) = 0;
  /// Whether changes in the channel are told from now on: not so when the link comes up.
  virtual void on_trusted(const fabric::ChannelKey& key, bool trusted) = 0;
  /// Something has changed there: it is time to read.
  virtual void on_change(const fabric::ChannelKey& key, Variable variable) = 0;
  /// Channels of this machine that have a channel.
  [[nodiscard]] virtual Channels channels_of(const std::string& machine) const = 0;
};

class Machines {
 public:
  /// All must outlive this.
  Machines(GatewayIdentity own, Fabric& fabric, Host& host, MachinesListener& listener)
      : own_(std::move(own)), fabric_(fabric), host_(host), listener_(listener), claims_(own_.id) {}
  Machines(const Machines&) = delete;
  Machines& operator=(const Machines&) = delete;

  /// The machines to serve from now on. One that is named no more is served until its calls under
  /// way are answered. One whose address or channels changed is connected to anew.
  void set(const std::vector<settings::MachineSettings>& machines, Moment now);

  /// What other gateways say on the fabric.
  void on_machine(const fabric::MachineStatus& status, Moment now);
  void on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway, Moment now);
  void on_channel(const fabric::ChannelStatus& status, Moment now);

  // What the links say, also one that was taken away a moment ago.
  void on_link_up(const std::string& machine, const Channels& channels, Moment now);
  void on_link_down(const std::string& machine, const std::string& reason, Moment now);
  /// To be told before anything else learns what was read.
  void on_read(const fabric::ChannelKey& key, const ServiceSnapshot& snapshot, Moment now);
  void on_subscribed(const std::string& machine,
                     const std::vector<machines::SubscribeOutcome>& outcomes, Moment now);
  void on_notification(const fabric::ChannelKey& key, Variable variable,
                       std::optional<std::uint32_t> value, Moment now);
  /// What came of a question of its values.
  void on_answer(const std::string& machine, const machines::Answer& answer, Moment now);
  /// False if the link was taken away: what it still says is of no interest.
  [[nodiscard]] bool linked(const std::string& machine) const {
    return machines_.at(machine).connected() != nullptr;
  }

  /// A channel that was removed, or is another gateway's, is over.
  void on_over(const fabric::ChannelKey& key) { reviews_.insert(key.machine); }
  /// This process stood still for longer than others wait for it: machines that another gateway may
  /// have taken over are let go of, until it is known who serves them. False if there are none. All
  /// are told anew, since who takes this gateway for gone has forgotten what it told.
  bool on_stall(Moment now);
  /// About once a second: tells how busy the links are.
  void publish_load(Moment now);

  void read(const fabric::ChannelKey& key, ReadSet set);
  void write(const fabric::ChannelKey& key, Variable variable, const Value& value);
  /// The link has answered a read or write of a call.
  void on_call_answered(const std::string& machine, Moment now);
  /// Somebody asks for a variable. Left to other gateways if the channel is not ours.
  void on_request(const fabric::VariableRequest& request, Moment now);
  /// Null if it was taken away, or the machine is not ours.
  [[nodiscard]] machines::Controller* link_of(const std::string& machine) const;

  /// Where each event ends: does what the event has left to do.
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

    /// Whether other gateways serve it is found out first.
    struct Listening {
      SteadyTime since;
      SteadyTime until;
    };
    /// All its channels are another gateway's, which the controller shall not be troubled for.
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
    /// The configuration names it no more.
    bool removed = false;
    /// Who serves it in our place, as it was logged last.
    std::string refusal{};
    /// What is missing although it is up: channels that others serve.
    std::string note{};
    machines::Subscriptions subscriptions;
    MachineValues values;
  };

  Machine* find_linked(const std::string& machine);
  /// To change them: then ask_values() looks at all machines.
  MachineValues& values_of(Machine& one);
  Machine& add(const settings::MachineSettings& settings, Moment now);
  void change(Machine& one, const settings::MachineSettings& settings, Moment now);
  /// What another gateway says of a machine; false if it does not count for ours.
  bool consider(const fabric::MachineStatus& status, Moment now);
  void warn_limited(const std::string& kind, const std::string& about, const std::string& text,
                    Moment now);
  void listen(Machine& one, Moment now);
  void listened(Machine& one, Moment now);
  void review(const std::string& machine, Moment now);
  bool owned_by_others(Machine& one, Moment now);
  /// Of a machine that is up.
  void serve(Machine& one, Moment now);
  void connect(Machine& one, Moment now);
  void drop_link(Machine& one, const std::string& reason, Moment now);
  void remove(Machine& one, std::uint16_t channel, Moment now);
  void not_owner(Machine& one, std::uint16_t channel, const std::string& reason, Moment now);
  void on_predecessor_call(const fabric::ChannelKey& key);
  void publish(Machine& one);
  void apply(Machine& one, const machines::SubscriptionActions& actions, Moment now);
  static std::string note_of(const Machine& one);
  void wake_at(std::optional<SteadyTime> time);

  GatewayIdentity own_;
  Fabric& fabric_;
  Host& host_;
  MachinesListener& listener_;
  machines::Claims claims_;
  std::map<std::string, Machine> machines_;
  /// Values of a machine have changed, or wait for calls; most events leave them alone.
  bool values_changed_ = false;
  /// When values are due next, of all machines.
  std::optional<SteadyTime> values_time_;
  /// Machines to be looked at anew once the event at hand is over.
  std::set<std::string> reviews_;
  /// None is due before.
  std::optional<SteadyTime> next_;
  /// What channels of contested machines showed last, while others served them.
  std::map<fabric::ChannelKey, fabric::ChannelStatus> last_seen_;
  /// What a stranger may say ten thousand times a second is said once.
  fabric::LogLimiter log_limiter_;
  /// The gateway that left each machine last.
  std::map<std::string, std::string> predecessors_;
};

}  // namespace millrace::gateway::core
