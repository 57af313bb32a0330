// Fills in what a sample does not say of itself, from what came before it.
#pragma once

#include <map>
#include <string>

#include "fabric/recent_keys.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::bus {

/// Pure. Takes each entry in the order it was received.
class Context {
 public:
  /// Of so many channels of gateways the last request is remembered: each run of a tool that calls
  /// is a gateway of its own, and a recorder runs for months.
  static constexpr std::size_t most_pending = 16'384;

  /// Sets the UUID of entries that carry none, and the call of withdrawals, which carry its epoch.
  void complete(recording::Entry& entry);

 private:
  struct Pending {
    fabric::CallId call;
    std::string uuid;
  };

  void remember(const recording::Entry& entry);

  std::map<fabric::InstanceId, std::string> uuid_of_instance_;
  std::map<fabric::RequestKey, Pending> pending_;
  fabric::RecentKeys recent_{most_pending};
};

}  // namespace millrace::tools::bus
