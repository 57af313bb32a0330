// The machines a gateway is set up for: connects to each, serves the channels that no other gateway
// serves, and tells the fabric how its links are. Decides only; `MachinesIo` have the sockets.
//
//   Machines machines(own, hands, listener);
//   machines.set(settings.machines);                  // again when the configuration changes
//   → hands.connect(…), listener.on_link_up("cnc", {1, 2}), listener.on_machine_status(status)
//
// Of two gateways that claim a channel the one that claimed it first serves it. The other does not
// even connect if all its channels are taken (a controller keeps one connection for each host), and
// takes over when the first is gone. So that two that start together see each other first, each
// listens for a moment before it serves.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "fabric/messages.hpp"
#include "gateway/machines/link.hpp"
#include "gateway/moment.hpp"
#include "gateway/settings/settings.hpp"

namespace millrace::gateway::machines {

/// What a gateway tells of itself.
struct GatewayIdentity {
  fabric::InstanceId id{};
  std::string host{};
  std::uint32_t pid = 0;
  std::string version{};
  /// Of its journal, which its calls carry.
  std::uint64_t epoch = 0;
};

/// on_link_up() names the channels to serve, also when their number grew
/// while the link was up.
class MachinesListener : public LinkEvents {
 public:
  /// Whether changes in the channel are told from now on: not so when the link comes up.
  virtual void on_pushed(const fabric::ChannelKey& key, bool pushed) = 0;
  /// Something has changed there: it is time to look.
  virtual void on_change(const fabric::ChannelKey& key, Variable variable) = 0;
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
  /// Channels of this machine that have a session.
  [[nodiscard]] virtual std::vector<std::uint16_t> channels_of(
      const std::string& machine) const = 0;

 private:
  // The machines keep these to themselves.
  void on_watched(const std::string&, const std::vector<WatchOutcome>&) final {}
  void on_told(const fabric::ChannelKey&, Variable, std::optional<std::uint32_t>) final {}
};

/// What the machines have done for them. Calls nothing back from within. That this process stood
/// still (Machines::stood_still) comes before what a link or after() brings: in the midst of an
/// event it would take away the link that the rest of the event is about.
class MachinesIo {
 public:
  virtual ~MachinesIo() = default;
  [[nodiscard]] virtual Moment now() const = 0;
  /// `act` may be called when the machines are gone already.
  virtual void after(std::chrono::nanoseconds delay, std::function<void()> act) = 0;
  /// A link that begins to connect.
  virtual std::unique_ptr<Link> connect(const settings::MachineSettings& settings,
                                        LinkEvents& events) = 0;
  /// A line for the log.
  virtual void say(Level level, const std::string& text) = 0;
};

class Machines {
 public:
  /// Both must outlive this.
  Machines(GatewayIdentity own, MachinesIo& hands, MachinesListener& listener);
  ~Machines();
  Machines(const Machines&) = delete;
  Machines& operator=(const Machines&) = delete;

  /// The machines to serve from now on. One that is named no more is served until its calls under
  /// way are answered. One whose address or channels changed is connected to anew.
  void set(const std::vector<settings::MachineSettings>& machines);

  /// What other gateways say on the fabric.
  void on_machine(const fabric::MachineStatus& status);
  void on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway);
  void on_channel(const fabric::ChannelStatus& status);

  /// A session that was retired or refused is over.
  void on_over(const fabric::ChannelKey& key);
  /// This process stood still for longer than others wait for it: machines that another gateway may
  /// have taken over are let go of, until it is known who serves them. False if there are none. All
  /// are told anew, since who takes this gateway for gone has forgotten what it told.
  bool stood_still();
  /// About once a second: tells how busy the links are.
  void tell_load();

  void read(const fabric::ChannelKey& key, ReadSet look);
  void write(const fabric::ChannelKey& key, Variable variable, const Value& value);

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::gateway::machines
