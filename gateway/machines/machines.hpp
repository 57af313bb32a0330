// The machines a gateway is set up for: connects to each, serves the channels that no other gateway
// serves, and tells the fabric how its links are. Decides only; `MachinesIo` has the sockets.
//
//   Machines machines(own, io, listener);
//   machines.set(settings.machines);                  // again when the configuration changes
//   machines.on_time();                               // once machines.next_time() has come
//   → io.connect(…), listener.on_serve("cnc", {1, 2}), listener.on_machine_status(status)
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
#include <vector>

#include "fabric/complaints.hpp"
#include "fabric/messages.hpp"
#include "gateway/machines/claims.hpp"
#include "gateway/machines/link.hpp"
#include "gateway/machines/machine_report.hpp"
#include "gateway/moment.hpp"
#include "gateway/settings/settings.hpp"

namespace millrace::gateway::machines {

using Channels = std::vector<std::uint16_t>;

/// What a gateway tells of itself.
struct GatewayIdentity {
  fabric::InstanceId id{};
  std::string host{};
  std::uint32_t pid = 0;
  std::string version{};
  /// Of its journal, which its calls carry.
  std::uint64_t epoch = 0;
};

/// What becomes of machines and their channels. May ask channels_of(), and calls nothing else back
/// from within.
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
  virtual void on_retired(const fabric::ChannelKey& key) = 0;
  /// Another gateway serves the channel.
  virtual void on_refused(const fabric::ChannelKey& key, const std::string& reason) = 0;
  /// We serve the channel from now on, in the place of a gateway that is gone and left this status.
  virtual void on_inherited(const fabric::ChannelStatus& status, const std::string& from) = 0;
  virtual void on_machine_status(const fabric::MachineStatus& status) = 0;
  virtual void on_machine_left(const fabric::MachineStatus& status) = 0;
  /// Another gateway is set up for channels of ours: what goes on in them is of interest.
  virtual void on_contested() = 0;
  /// Whether changes in the channel are told from now on: not so when the link comes up.
  virtual void on_pushed(const fabric::ChannelKey& key, bool pushed) = 0;
  /// Something has changed there: it is time to look.
  virtual void on_change(const fabric::ChannelKey& key, Variable variable) = 0;
  /// Channels of this machine that have a session.
  [[nodiscard]] virtual Channels channels_of(const std::string& machine) const = 0;
};

/// What the machines have done for them. Calls nothing back from within.
class MachinesIo {
 public:
  virtual ~MachinesIo() = default;
  [[nodiscard]] virtual Moment now() const = 0;
  /// A link that begins to connect. What it says comes to the functions on_link_up() to on_told().
  virtual std::unique_ptr<Link> connect(const settings::MachineSettings& settings) = 0;
  /// A line for the log.
  virtual void say(Level level, const std::string& text) = 0;
};

class Machines {
 public:
  /// Both must outlive this.
  Machines(GatewayIdentity own, MachinesIo& io, MachinesListener& listener)
      : own_(std::move(own)), io_(io), listener_(listener), claims_(own_.id) {}
  Machines(const Machines&) = delete;
  Machines& operator=(const Machines&) = delete;

  /// The machines to serve from now on. One that is named no more is served until its calls under
  /// way are answered. One whose address or channels changed is connected to anew.
  void set(const std::vector<settings::MachineSettings>& machines);

  /// What other gateways say on the fabric.
  void on_machine(const fabric::MachineStatus& status);
  void on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway);
  void on_channel(const fabric::ChannelStatus& status);

  // What the links say, also one that was taken away a moment ago.
  void on_link_up(const std::string& machine, const Channels& channels);
  void on_link_down(const std::string& machine, const std::string& reason);
  /// To be told before anything else learns what was read.
  void on_read(const fabric::ChannelKey& key, const Snapshot& snapshot);
  void on_watched(const std::string& machine, const std::vector<WatchOutcome>& outcomes);
  void on_told(const fabric::ChannelKey& key, Variable variable,
               std::optional<std::uint32_t> value);
  /// False if the link was taken away: what it still says is of no interest.
  [[nodiscard]] bool linked(const std::string& machine) const {
    return machines_.at(machine).link != nullptr;
  }

  /// A session that was retired or refused is over.
  void on_over(const fabric::ChannelKey& key) { reviews_.insert(key.machine); }
  /// This process stood still for longer than others wait for it: machines that another gateway may
  /// have taken over are let go of, until it is known who serves them. False if there are none. All
  /// are told anew, since who takes this gateway for gone has forgotten what it told.
  bool stood_still();
  /// About once a second: tells how busy the links are.
  void tell_load();

  void read(const fabric::ChannelKey& key, ReadSet look);
  void write(const fabric::ChannelKey& key, Variable variable, const Value& value);
  /// The link has answered a read or write of a call.
  void on_call_answered(const std::string& machine);
  /// Since when none of them is under way; nothing while one is.
  [[nodiscard]] std::optional<SteadyTime> rests_since(const std::string& machine) const;
  /// Null if it was taken away, or the machine is not ours.
  [[nodiscard]] Link* link_of(const std::string& machine) const;

  /// Where each event ends: does what the event has left to do.
  void finish();
  void on_time();
  /// When on_time() has something to do, or before.
  [[nodiscard]] std::optional<SteadyTime> next_time() const { return next_; }

 private:
  /// One machine of the configuration.
  struct Machine {
    settings::MachineSettings settings;
    MachineReport report;
    /// It listens for other gateways since `listens_since`, until this.
    std::optional<SteadyTime> listens_until{};
    SteadyTime listens_since{};
    /// It may have served already; then its claim is not moved behind those of others.
    bool has_served = false;
    std::unique_ptr<Link> link{};
    /// Reads and writes of calls that the link has not answered.
    std::size_t calls_under_way = 0;
    /// Since when there are none.
    SteadyTime rests_since{};
    bool up = false;
    /// What the controller has, while the link is up.
    Channels found{};
    std::set<std::uint16_t> served{};
    /// The configuration names it no more.
    bool leaving = false;
    /// Who serves it in our place, as it was logged last.
    std::string refusal{};
    /// What is missing although it is up: channels that others serve.
    std::string note{};
    Watch watch{settings.watch};
  };

  Machine* find_linked(const std::string& machine);
  Machine& add(const settings::MachineSettings& settings);
  void change(Machine& one, const settings::MachineSettings& settings);
  /// What another gateway says of a machine; false if it does not count for ours.
  bool take(const fabric::MachineStatus& status);
  void complain(const std::string& kind, const std::string& about, const std::string& text);
  void listen(Machine& one);
  void listened(Machine& one);
  void review(const std::string& machine);
  bool refused_by_all(Machine& one);
  void serve(Machine& one);
  void connect(Machine& one);
  void drop_link(Machine& one, const std::string& reason);
  void inherit(const fabric::ChannelKey& key);
  void publish(Machine& one);
  void carry_out(Machine& one, const WatchActions& actions);
  static std::string note_of(const Machine& one);
  void wake_at(std::optional<SteadyTime> time);

  GatewayIdentity own_;
  MachinesIo& io_;
  MachinesListener& listener_;
  Claims claims_;
  std::map<std::string, Machine> machines_;
  /// Machines to be looked at anew once the event at hand is over.
  std::set<std::string> reviews_;
  /// None is due before.
  std::optional<SteadyTime> next_;
  /// What channels of contested machines showed last, while others served them.
  std::map<fabric::ChannelKey, fabric::ChannelStatus> last_seen_;
  /// What a stranger may say ten thousand times a second is said once.
  fabric::Complaints complaints_;
  /// The gateway that left each machine last.
  std::map<std::string, std::string> predecessors_;
};

}  // namespace millrace::gateway::machines
