// Dispatches each call to exactly one instance. Pure: takes events of discovery and channels,
// returns decisions.
//
//   Dispatcher dispatcher;
//   dispatcher.on_instance_ready(identity);
//   auto decisions = dispatcher.add({id, key, uuid});      → Assign{id, key, assignment}
//   decisions = dispatcher.on_instance_gone(instance, now);
//   decisions = dispatcher.on_time(now);                   → Unassign, Assign to another
//
// "Gone" is a hint: a gateway that was frozen loses all instances for a moment. So a lost instance
// keeps its calls for a grace period and continues them if it comes back within it.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "fabric/messages.hpp"
#include "gateway/call_record.hpp"
#include "gateway/dispatch/instances.hpp"
#include "gateway/dispatch/pending_calls.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::dispatch {

/// Dispatch the call to this instance; the same attempt again repeats it to an instance that came
/// back.
struct Assign {
  fabric::CallId call;
  fabric::ChannelKey key;
  Assignment assignment;
};

/// The call's instance is lost. It waits for another one, or, if `held`, for an operator.
struct Unassign {
  fabric::CallId call;
  fabric::ChannelKey key;
  fabric::Message reason;
  bool held = false;
};

/// Why the call waits.
struct Explain {
  fabric::CallId call;
  fabric::ChannelKey key;
  fabric::Message reason;
};

using Decision = std::variant<Assign, Unassign, Explain>;
using Decisions = std::vector<Decision>;

struct DispatcherOptions {
  /// How long a lost instance keeps its calls. About 10 ms after a frozen gateway wakes, it finds
  /// its instances again.
  std::chrono::milliseconds grace{50};
  /// The same for the instances in the journal when the gateway starts and has not discovered any.
  std::chrono::milliseconds rejoin{1500};
  /// An instance sends heartbeats without a call that was sent to it this long ago: it does not
  /// receive, or is not received. After the second such heartbeat the call goes to another one.
  std::chrono::milliseconds unresponsive{700};
  /// An unresponsive instance is tried again after this time.
  std::chrono::milliseconds unresponsive_pause{5000};
  /// How long an instance that declined is skipped if no heartbeat shows room. One that declines
  /// again and again is skipped for as long as an unresponsive one, whatever its heartbeats show.
  std::chrono::milliseconds busy_pause{1000};
};

class Dispatcher {
 public:
  explicit Dispatcher(DispatcherOptions options = {}) : options_(options) {}
  Dispatcher(const Dispatcher&) = delete;
  Dispatcher& operator=(const Dispatcher&) = delete;

  /// A new instance, one that came back, or one whose identity changed (draining, channels).
  Decisions on_instance_ready(const fabric::InstanceIdentity& identity);
  Decisions on_instance_gone(const fabric::InstanceId& instance, SteadyTime now);
  /// The load of an instance, from a heartbeat that just arrived.
  Decisions on_load(const fabric::InstanceLoad& load, SteadyTime now);
  /// The call's request is on its way to the instance that has it.
  void on_published(const fabric::CallId& call, SteadyTime now);
  /// The instance that has the call declines it.
  Decisions decline(const fabric::CallId& call, SteadyTime now);
  /// Removes instances that have been gone for too long.
  Decisions on_time(SteadyTime now);
  /// When on_time has something to do.
  [[nodiscard]] std::optional<SteadyTime> next_time() const { return instances_.next_alarm(); }

  /// The number of instances, including temporarily lost ones.
  [[nodiscard]] std::size_t known() const { return instances_.size(); }

  [[nodiscard]] bool serves(const std::string& canonical_uuid, const fabric::ChannelKey& key) const;

  /// Why no instance serves this UUID for this channel; nullopt if one does.
  [[nodiscard]] std::optional<fabric::Message> why_unserved(const std::string& uuid,
                                                            const fabric::ChannelKey& key) const;

  /// How often a call of this canonical UUID may run: at most once if any instance announces it.
  [[nodiscard]] fabric::Delivery delivery_of(const std::string& uuid) const;

  /// A call to dispatch: a new one, or one that an operator dispatches again, as a new attempt and
  /// wherever it is; an at-most-once call is then the operator's responsibility.
  Decisions add(std::shared_ptr<const CallRecord> call);
  Decisions add(CallRecord call) {
    return add(std::make_shared<const CallRecord>(std::move(call)));
  }
  /// A call of an earlier run, last dispatched to the instance of its last attempt.
  Decisions resume(std::shared_ptr<const CallRecord> call, SteadyTime now);
  /// The call is answered or over.
  Decisions remove(const fabric::CallId& call);

 private:
  /// All that waits for instances of a UUID, after these changed.
  void assign_waiting(const std::string& uuid, Decisions& decisions);
  /// One call that waits: gives it, or says why it waits.
  void try_to_assign(PendingCall& pending, Decisions& decisions);
  /// Assigns waiting calls to this instance, which has room.
  void fill(Instance& instance, Decisions& decisions);
  void assign(PendingCall& pending, Instance& instance, Decisions& decisions);
  void assign_again(Instance& instance, Decisions& decisions);
  void lose(Instance& instance, Decisions& decisions);
  enum class Loss : std::uint8_t { gone, unresponsive };
  void lose_call(PendingCall& pending, Loss loss, Decisions& decisions);
  [[nodiscard]] fabric::Message why_waiting(const PendingCall& pending) const;

  DispatcherOptions options_;
  Instances instances_;
  PendingCalls calls_;
  /// By canonical UUID: the last instance of services without an instance.
  std::map<std::string, std::string> last_of_;
};

}  // namespace millrace::gateway::dispatch
