// Fills in what a sample does not say of itself, from what came before it.
#pragma once

#include <deque>
#include <map>
#include <string>

#include "fabric/observer/entry.hpp"
#include "fabric/recent_keys.hpp"

namespace millrace::fabric::observer {

/// Pure. Takes each entry in the order it was received.
class Context {
 public:
  /// Of so many channels of gateways the last request is remembered: each run of a tool that calls
  /// is a gateway of its own, and a recorder runs for months.
  static constexpr std::size_t most_pending = 16'384;
  /// So many instances are remembered that are gone: one that crashes at each start is a new one
  /// each time.
  static constexpr std::size_t most_gone = 1024;

  /// Sets the UUID of entries that carry none, and the call of withdrawals, which carry its epoch.
  void complete(Entry& entry);

 private:
  struct Pending {
    CallId call;
    std::string uuid;
  };

  void remember(const Entry& entry);

  std::map<InstanceId, std::string> uuid_of_instance_;
  /// Of those that are gone, the one that went first in front.
  std::deque<InstanceId> gone_;
  std::map<RequestKey, Pending> pending_;
  RecentKeys recent_{most_pending};
};

}  // namespace millrace::fabric::observer
