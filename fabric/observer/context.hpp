// Completes samples with members that they leave out, from the samples before them.
#pragma once

#include <map>
#include <string>

#include "fabric/observer/entry.hpp"
#include "fabric/request_key.hpp"

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
  /// More than wait for an outcome at a time.
  static constexpr std::size_t most_commands = 1024;

  /// Sets the UUID of entries that carry none, and the call of withdrawals, which carry its epoch.
  void complete(Entry& entry);

  /// This requester has made the request of that channel, or no requester is known.
  [[nodiscard]] bool has_asked(const RequestKey& key) const;
  /// No other instance was asked instead, as far as is known.
  [[nodiscard]] bool was_given(const Reply& reply) const;
  /// The first command of this id; nullptr if it is not remembered.
  [[nodiscard]] const Command* find_command(const InstanceId& id) const;

 private:
  struct Pending {
    CallId call;
    std::string uuid;
  };

  void remember(const Entry& entry);
  /// `use(key, pending)` for what was asked of each instance for this channel in this epoch.
  template <typename Use>
  void for_each_requester(const RequestKey& from, const Use& use) const;

  std::map<InstanceId, std::string> uuid_of_instance_;
  base::Recent<InstanceId> gone_{most_gone};
  std::map<RequestKey, Pending> pending_;
  RecentRequests<> recent_{most_pending};
  base::Recent<InstanceId, Command> commands_{most_commands};
};

}  // namespace millrace::fabric::observer
