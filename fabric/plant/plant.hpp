// The present state of a fabric, from what an observer receives. Pure.
//
//   plant.add(entry);
//   for (const auto& [id, instance] : plant.instances()) …
//
// assess.hpp says what of it is wrong.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fabric/alarm.hpp"
#include "fabric/observer/entry.hpp"

namespace millrace::fabric::plant {

struct KnownInstance {
  InstanceIdentity identity{};
  /// Nullopt until its first status.
  std::optional<InstanceStatus> status{};
};

/// A machine whose gateway is gone.
struct LostMachine {
  /// The last sample of that gateway about it.
  MachineStatus last{};
  Time since{};
  /// `gateway_released`, `gateway_not_responding`, `gateway_gone`
  Message reason{};
};

/// The NC program of a channel, as far as it is of interest: a program that has ended is not.
struct Program {
  enum class State : std::uint8_t { running, on_hold, aborted };
  State state = State::running;
  /// The last event; of an aborted program, until its error is cleared.
  ProgramEvent event{};
  /// Its gateway is gone, and no gateway has published it since.
  bool stale = false;
};

/// An instance that is gone or silent, with what it last published.
struct GoneInstance {
  KnownInstance last{};
  Time at{};
  /// Its process is there, and does not respond.
  bool silent = false;
  /// A new instance of the service has come since.
  bool replaced = false;
};

/// A process that said all the time that it runs (says_that_it_runs), and is gone without having
/// taken that back.
struct LostProcess {
  /// The last one.
  Alarm last{};
  Time at{};
};
/// A process publishes alarms of this kind as long as it runs: "recording" of a recorder, "page" of
/// a web server.
bool says_that_it_runs(const AlarmKey& key);

class Plant {
 public:
  /// True if a process or an NC program appeared or disappeared; false for news of known ones.
  bool add(const observer::Entry& entry);
  /// What the DDS domain has besides this fabric: for a fabric without a gateway, which may be the
  /// wrong one.
  void set_other_fabrics(std::set<std::string> names) { other_fabrics_ = std::move(names); }

  [[nodiscard]] const std::map<InstanceId, KnownInstance>& instances() const { return instances_; }
  /// The last instances that ended or fell silent.
  [[nodiscard]] const std::map<InstanceId, GoneInstance>& gone() const { return gone_; }
  /// By the responder of their alarms.
  [[nodiscard]] const std::map<InstanceId, LostProcess>& lost_processes() const {
    return lost_processes_;
  }
  /// Removes a machine without a present gateway, its channels and NC programs, until a gateway
  /// reports it again; false if it has one, or is unknown.
  bool forget_machine(const std::string& machine);
  /// Removes what has been gone since before `time`, but for instances that are only silent.
  void forget_gone(Time time);
  [[nodiscard]] const std::map<ChannelKey, ChannelStatus>& channels() const { return channels_; }
  /// By machine and gateway: two gateways may be configured for one machine.
  using Machines = std::map<std::pair<std::string, InstanceId>, MachineStatus>;
  [[nodiscard]] const Machines& machines() const { return machines_; }
  /// The last sample about the machine from the gateway of `status` while it was present; nullptr
  /// if there was none.
  [[nodiscard]] const MachineStatus* last_sample(const MachineStatus& status) const;
  [[nodiscard]] const std::set<std::string>& other_fabrics() const { return other_fabrics_; }
  /// Some gateway reports about some machine.
  [[nodiscard]] bool has_gateway() const;
  /// Some gateway reports about the machine.
  [[nodiscard]] bool has_gateway(std::string_view machine) const;
  /// Some gateway reports about the machine, or did.
  [[nodiscard]] bool knows_machine(std::string_view machine) const;
  /// Its machine is served by another gateway: it needs no connection.
  [[nodiscard]] bool is_connected_through_another(const MachineStatus& status) const;
  /// This gateway had a connection, which `status` says is gone.
  [[nodiscard]] bool loses_link(const MachineStatus& status) const;
  /// The gateway of `status` has lost its connection to this machine, and had none since.
  [[nodiscard]] bool lost_link(const MachineStatus& status) const;
  /// Each machine without a present gateway, with the last one.
  [[nodiscard]] std::vector<LostMachine> lost() const;
  /// The same of this machine; nothing if it has a gateway, or is unknown.
  [[nodiscard]] std::optional<LostMachine> lost(std::string_view machine) const;
  /// The last sample of each gateway about one of its machines; also of gateways that are taken for
  /// gone, of which machines() has only that.
  [[nodiscard]] const std::map<InstanceId, MachineStatus>& gateways() const { return gateways_; }

  /// A service that crashes at each start is a new instance each time: the newest are kept.
  static constexpr std::size_t most_gone = 1'000;
  /// A stranger can publish any number of alarms and program events.
  static constexpr std::size_t most_alarms = 1'000;
  static constexpr std::size_t most_programs = 1'000;
  [[nodiscard]] const std::map<AlarmKey, Alarm>& alarms() const { return alarms_; }
  [[nodiscard]] bool too_many_alarms() const { return too_many_alarms_; }

  /// The number of instances that accept calls of this UUID from this channel: draining ones accept
  /// none.
  [[nodiscard]] std::size_t instances_for(const std::string& uuid, const ChannelKey& key) const;
  /// The journal alarm that keeps the gateways of this machine from accepting calls; nullptr if
  /// there is none.
  [[nodiscard]] const Alarm* journal_alarm(std::string_view machine) const;
  /// Nothing where no program runs and none was aborted, or where its state is unknown.
  [[nodiscard]] const Program* program_of(const ChannelKey& key) const;
  /// The instances whose UUID, id or name is `what`, without regard to the case of ASCII letters;
  /// all for an empty text.
  [[nodiscard]] std::vector<const KnownInstance*> instances_of(const std::string& what) const;

 private:
  bool add(const observer::InstanceNews& news, Time at);
  void add(const InstanceStatus& status);
  bool add(const ChannelStatus& status);
  bool add(const MachineStatus& status);
  /// The machine is no longer in the configuration of this gateway.
  void forget(const MachineStatus& removed);
  void forget_channels_of(const std::string& machine);
  /// By forget_machine(): the disappearance of its gateway and its channels is no news then.
  [[nodiscard]] bool is_forgotten(std::string_view machine) const;
  bool add(const ProgramEvent& event);
  bool add(const observer::AlarmNews& news, Time at);
  bool add(const Alarm& alarm);
  bool mark_gone(const InstanceId& id, Time at, bool is_silent);
  void mark_replaced(const std::string& uuid);
  template <typename Change>
  void for_programs_of(const std::string& machine, const Change& change);

  std::map<InstanceId, KnownInstance> instances_;
  std::map<InstanceId, GoneInstance> gone_;
  std::map<InstanceId, LostProcess> lost_processes_;
  std::map<ChannelKey, ChannelStatus> channels_;
  Machines machines_;
  struct Presence {
    /// The last sample of the gateway while it was present.
    MachineStatus last{};
    /// Its connection was lost and is not back, while no other gateway served the machine.
    bool lost_link = false;
  };
  std::map<Machines::key_type, Presence> presence_;
  std::map<InstanceId, MachineStatus> gateways_;
  std::map<AlarmKey, Alarm> alarms_;
  bool too_many_alarms_ = false;
  std::map<ChannelKey, Program> programs_;
  std::set<std::string> other_fabrics_;
  /// Status of instances that discovery has not shown yet.
  std::map<InstanceId, InstanceStatus> early_;
};

}  // namespace millrace::fabric::plant
