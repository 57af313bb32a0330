// Which instances run: discovery and heartbeats feed a registry, and a timer fires when a process
// has been silent for too long. For endpoints that use instances.
//
//   LivenessMonitor liveness(executor, {.on_load = …, .announce = …});
//   liveness.open(participant, Discovery::Of::calls, weak_from_this(), on_endpoint, on_heartbeat);
//   liveness.update();                                             // in the turn of on_endpoint
//   liveness.drain_heartbeats();                                   // in the turn of on_heartbeat
//   for (const InstanceId& instance : liveness.changes().gone) …   // after both
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <tl/expected.hpp>

#include "fabric/dds/authenticator.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/endpoints/discovery.hpp"
#include "fabric/registry/instance_registry.hpp"
#include "fabric/wire/subscription.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::endpoints {

/// To be used on one executor, which runs one thing at a time.
class LivenessMonitor {
 public:
  /// Functions of the owner.
  struct Owner {
    /// A heartbeat names the load of an instance; `is_theirs` if the instance belongs to the
    /// process that sent the heartbeat.
    std::function<void(registry::EndpointHandle writer, const InstanceLoad& load, bool is_theirs,
                       SteadyTime at)>
        on_load;
    /// Passes on changes(), when silent instances were searched.
    std::function<void()> announce;
  };

  LivenessMonitor(const boost::asio::any_io_executor& executor, Owner owner)
      : owner_(std::move(owner)), silence_(executor) {}
  LivenessMonitor(const LivenessMonitor&) = delete;
  LivenessMonitor& operator=(const LivenessMonitor&) = delete;

  /// Throws std::runtime_error with Cyclone's reason. `alive` sees the owner gone; `on_endpoint`
  /// and `on_heartbeat` outlive what is opened here, which close() ends. `batches_per_turn`
  /// limits drain_heartbeats as SubscriptionOptions does.
  void open(const dds::Participant& participant, Discovery::Of of, std::weak_ptr<void> alive,
            dds::PostOnce& on_endpoint, dds::PostOnce& on_heartbeat, int batches_per_turn = 0);
  void close();

  /// Applies the news of discovery and of identities.
  Discovery::News update();

  /// Passes on the heartbeats that have arrived; true if there may be more.
  bool drain_heartbeats() { return heartbeats_.drain(); }

  /// A request was sent to this instance, which should soon send a heartbeat.
  void requested(const InstanceId& instance);

  /// The changes since the last call; sets the timer.
  registry::InstanceRegistry::Changes changes();

  [[nodiscard]] registry::InstanceRegistry& registry() { return registry_; }

 private:
  void take(const wire::Taken<Heartbeat>& taken);
  void check_identities(Discovery::News& news);
  void await_silence();
  void on_silence(SteadyTime due);

  Owner owner_;
  std::weak_ptr<void> alive_;
  registry::InstanceRegistry registry_;
  std::optional<Discovery> discovery_;
  wire::Subscription<Heartbeat> heartbeats_;
  /// The writers that send heartbeats of ever new processes, until they were reported.
  std::set<std::string> flooding_;
  /// Null without trust.
  dds::Authenticator* authenticator_ = nullptr;
  std::optional<dds::Authenticator::ChangeQueue> identity_changes_;
  dds::PostOnce* on_endpoint_ = nullptr;
  boost::asio::steady_timer silence_;
  std::optional<SteadyTime> silence_at_;
};

// The endpoint of a process with instances: publishes that it runs, and the load of its instances.
//
//   HeartbeatEndpoint end(participant, process);
//   end.publish({.process = process, .at = now, .loads = …});      // four times in the lease

class HeartbeatEndpoint {
 public:
  /// Heartbeats within a lease of a participant's instances: readers take silence for four fifths
  /// of it as their end, so two heartbeats may be lost or late.
  static constexpr int heartbeats_per_lease = 4;
  /// The lease of a process without calls, in those with calls.
  static constexpr int idle_leases = 3;

  /// `process` is in all its heartbeats. Throws std::runtime_error with Cyclone's reason.
  HeartbeatEndpoint(const dds::Participant& participant, const InstanceId& process);

  /// Fails for too many loads or calls. From any thread.
  tl::expected<void, std::string> publish(const Heartbeat& heartbeat) {
    return writer_.write(heartbeat);
  }

 private:
  wire::Writer<Heartbeat> writer_;
};

}  // namespace millrace::fabric::endpoints
