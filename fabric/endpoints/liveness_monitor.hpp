// Which instances run: discovery and heartbeats feed a registry, and a timer fires when a process
// has been silent for too long. For endpoints that use instances.
//
//   LivenessMonitor liveness(executor, {.drain_heartbeats = …, .announce = …});
//   liveness.open(participant, weak_from_this(), on_endpoint, on_heartbeat);   // who posts for them
//   liveness.update();                                   // in the turn that on_endpoint posts
//   while (liveness.take_heartbeats([&](writer, load, is_theirs, at) { … })) {}      // in that of on_heartbeat
//   for (const InstanceId& instance : liveness.changes().gone) …               // after either
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <tl/expected.hpp>

#include "fabric/dds/authenticator.hpp"
#include "fabric/dds/listeners.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/endpoints/discovery.hpp"
#include "fabric/registry/instance_registry.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::endpoints {

/// To be used on one executor, which runs one thing at a time.
class LivenessMonitor {
 public:
  /// Functions of the owner, called when silent instances must be found.
  struct Owner {
    /// Takes the heartbeats that have arrived: after a pause of this process, an instance whose
    /// heartbeats waited in that time is not silent.
    std::function<void()> drain_heartbeats;
    /// Passes on changes().
    std::function<void()> announce;
  };

  LivenessMonitor(const boost::asio::any_io_executor& executor, Owner owner)
      : owner_(std::move(owner)), silence_(executor) {}
  LivenessMonitor(const LivenessMonitor&) = delete;
  LivenessMonitor& operator=(const LivenessMonitor&) = delete;

  /// Throws std::runtime_error with Cyclone's reason. `alive` sees the owner gone; `on_endpoint`
  /// and `on_heartbeat` outlive what is opened here, which close() ends.
  void open(const dds::Participant& participant, std::weak_ptr<void> alive,
            dds::PostOnce& on_endpoint, dds::PostOnce& on_heartbeat);
  void close();

  /// Applies the news of discovery and of identities.
  Discovery::News update();

  /// Takes a batch of heartbeats and calls use(writer, load, is_theirs, at) for what each says of
  /// an instance: `is_theirs` if that instance is of the process that sends heartbeats. False if
  /// there was none.
  template <typename Use>
  bool take_heartbeats(Use use);

  /// The changes since the last call; sets the timer.
  registry::InstanceRegistry::Changes changes();

  [[nodiscard]] registry::InstanceRegistry& registry() { return registry_; }

 private:
  void check_identities(Discovery::News& news);
  void await_silence();
  void on_silence(SteadyTime due);

  Owner owner_;
  std::weak_ptr<void> alive_;
  registry::InstanceRegistry registry_;
  std::optional<Discovery> discovery_;
  std::optional<wire::Reader<Heartbeat>> heartbeats_;
  /// The writer that sends heartbeats of ever new processes, until it was reported.
  std::optional<std::string> flooding_;
  /// Null without trust.
  dds::Authenticator* authenticator_ = nullptr;
  std::optional<dds::Authenticator::ChangeQueue> identity_changes_;
  dds::PostOnce* on_endpoint_ = nullptr;
  boost::asio::steady_timer silence_;
  std::optional<SteadyTime> silence_at_;
};

template <typename Use>
bool LivenessMonitor::take_heartbeats(Use use) {
  if (!heartbeats_) {
    return false;
  }
  const auto batch = heartbeats_->take();
  if (auto flood = heartbeats_->take_flooding()) {
    flooding_ = *std::move(flood);
    on_endpoint_->post();
  }
  const SteadyTime at = std::chrono::steady_clock::now();
  for (const wire::Taken<Heartbeat>& taken : batch) {
    // It may be the first heartbeat of an unknown process; the next one follows.
    if (!taken.valid || !registry_.heartbeat(taken.writer, at)) {
      continue;
    }
    for (const InstanceLoad& load : taken.value.loads) {
      use(taken.writer, load, registry_.heartbeats_for(taken.writer, load.status.instance), at);
    }
  }
  return !batch.empty();
}

// The endpoint of a process with instances: publishes that it runs, and the load of its instances.
//
//   HeartbeatEndpoint end(participant);
//   end.publish({.process = process, .at = now, .loads = …});      // four times in the lease

class HeartbeatEndpoint {
 public:
  /// Heartbeats within the lease of a participant's instances: readers take silence for four fifths
  /// of it as their end, so two heartbeats may be lost or late.
  static constexpr int heartbeats_per_lease = 4;

  /// Throws std::runtime_error with Cyclone's reason.
  explicit HeartbeatEndpoint(const dds::Participant& participant)
      : writer_(participant, participant.options().fabric) {}

  /// Fails for too many loads or calls. From any thread.
  tl::expected<void, std::string> publish(const Heartbeat& heartbeat) {
    return writer_.write(heartbeat);
  }

 private:
  wire::Writer<Heartbeat> writer_;
};

}  // namespace millrace::fabric::endpoints
