// The present state of the fabric, from what an observer receives. Pure.
//
//   live.add(entry);
//   for (const auto& [id, instance] : live.instances()) …
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fabric/alarm.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::bus {

struct KnownInstance {
  fabric::InstanceIdentity identity{};
  /// Nullopt until its first status.
  std::optional<fabric::InstanceStatus> status{};
};

/// A machine whose gateway is gone.
struct LostMachine {
  /// The last sample of that gateway about it.
  fabric::MachineStatus last{};
  fabric::Time since{};
};

/// Why a channel's call does not continue, causes before effects.
enum class Obstacle : std::uint8_t {
  none,
  /// An operator must answer or retry it.
  held,
  /// Its gateway accepts no new calls because it cannot write its journal.
  journal,
  /// No instance accepts calls of its UUID from this channel.
  unserved,
  /// All instances are busy.
  busy,
  /// The same for longer than a call may wait.
  long_busy,
};

struct GoneInstance {
  KnownInstance last{};
  fabric::Time at{};
};

class FabricModel {
 public:
  /// True if a process appeared or disappeared; false for news of known ones.
  bool add(const recording::Entry& entry);
  /// Adds an alarm; true as for add().
  bool add(const fabric::Alarm& alarm);
  /// The alarm is over, or its process is gone.
  void take_back(const fabric::AlarmKey& key) { alarms_.erase(key); }

  [[nodiscard]] const std::map<fabric::InstanceId, KnownInstance>& instances() const {
    return instances_;
  }
  /// Instances that were there in this time, and are gone.
  [[nodiscard]] const std::map<fabric::InstanceId, GoneInstance>& gone() const { return gone_; }
  /// Removes those that have been gone since before `time`.
  void forget_gone(fabric::Time time);
  [[nodiscard]] const std::map<fabric::ChannelKey, fabric::ChannelStatus>& channels() const {
    return channels_;
  }
  /// By machine and gateway: two gateways may be configured for one machine.
  using Machines = std::map<std::pair<std::string, fabric::InstanceId>, fabric::MachineStatus>;
  [[nodiscard]] const Machines& machines() const { return machines_; }
  /// The last sample about the machine from the gateway of `status` while it was heard; nullptr if
  /// there was none.
  [[nodiscard]] const fabric::MachineStatus* told(const fabric::MachineStatus& status) const;
  /// Each machine without a present gateway, with the last one.
  [[nodiscard]] std::vector<LostMachine> lost() const;
  /// The last sample of each gateway about one of its machines; also of gateways that are taken for
  /// gone, of which machines() has only that.
  [[nodiscard]] const std::map<fabric::InstanceId, fabric::MachineStatus>& gateways() const {
    return gateways_;
  }

  /// A service that crashes at each start is a new instance each time: no more than these are kept.
  static constexpr std::size_t most_gone = 1'000;
  /// A stranger can publish any number of alarms: further ones are only counted.
  static constexpr std::size_t most_alarms = 1'000;
  [[nodiscard]] const std::map<fabric::AlarmKey, fabric::Alarm>& alarms() const { return alarms_; }
  [[nodiscard]] bool too_many_alarms() const { return too_many_alarms_; }

  /// The number of instances that accept calls of this UUID from this channel: draining ones accept
  /// none.
  [[nodiscard]] std::size_t instances_for(const std::string& uuid,
                                          const fabric::ChannelKey& key) const;
  /// The journal alarm that keeps the gateways of this machine from accepting calls; nullptr if
  /// there is none.
  [[nodiscard]] const fabric::Alarm* journal_alarm(std::string_view machine) const;
  /// How long a call may wait for a free instance.
  static constexpr std::chrono::minutes patience_of_a_call{1};
  [[nodiscard]] Obstacle obstacle_of(const fabric::ChannelStatus& status, fabric::Time now) const;
  /// The instances whose UUID, id or name is `what`, compared without regard to case for the first
  /// two; all for an empty text.
  [[nodiscard]] std::vector<const KnownInstance*> instances_of(const std::string& what) const;

 private:
  void mark_gone(const fabric::InstanceId& id, fabric::Time at);

  std::map<fabric::InstanceId, KnownInstance> instances_;
  std::map<fabric::InstanceId, GoneInstance> gone_;
  std::map<fabric::ChannelKey, fabric::ChannelStatus> channels_;
  Machines machines_;
  /// The last samples of gateways while they were heard.
  Machines told_;
  std::map<fabric::InstanceId, fabric::MachineStatus> gateways_;
  std::map<fabric::AlarmKey, fabric::Alarm> alarms_;
  bool too_many_alarms_ = false;
  /// Status of instances that discovery has not shown yet.
  std::map<fabric::InstanceId, fabric::InstanceStatus> early_;
};

}  // namespace millrace::tools::bus
