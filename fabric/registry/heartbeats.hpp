// Chooses the contents of the next heartbeat of a process. Pure.
//
//   for (…) heartbeats.note(load);          // all instances, before each heartbeat
//   Heartbeat heartbeat = heartbeats.next(now);
//
// A heartbeat has room for the loads of 64 instances, and a process may have a thousand: those that
// have calls and those whose numbers changed lately come first, the others in turn.
#pragma once

#include <cstdint>
#include <map>

#include "fabric/messages.hpp"

namespace millrace::fabric::registry {

class Heartbeats {
 public:
  static constexpr std::size_t most_loads = 64;
  /// Number of heartbeats that repeat a change: some may be lost, and tools take one a second,
  /// which is one in eight of a process with calls at the usual lease.
  static constexpr std::uint64_t repeats = 15;
  /// Number of other instances in each heartbeat, for new readers.
  static constexpr std::size_t in_turn = 16;

  explicit Heartbeats(const InstanceId& process) : process_(process) {}

  void note(const InstanceLoad& load);
  void forget(const InstanceId& instance);
  [[nodiscard]] Heartbeat next(Time now);

 private:
  struct Known {
    InstanceLoad load;
    /// The number of the heartbeat in which it changed.
    std::uint64_t changed = 0;
  };

  InstanceId process_;
  std::uint64_t number_ = 1;
  std::map<InstanceId, Known> known_;
  /// The last instance that was included in turn, or because it has calls.
  InstanceId last_;
};

}  // namespace millrace::fabric::registry
