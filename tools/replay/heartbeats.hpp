// Heartbeats for the instances of a replay, like those of a service: they show gateways that the
// instances run, and which calls they have.
//
//   InstanceHeartbeats heartbeats(participant, executor, [this] { return loads(); });   // runs from here on
#pragma once

#include <functional>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

#include "fabric/dds/participant.hpp"
#include "fabric/endpoints/heartbeat_endpoint.hpp"
#include "fabric/registry/heartbeats.hpp"

namespace millrace::tools::replay {

/// Lives on the executor, which runs one thing at a time.
class InstanceHeartbeats {
 public:
  /// The current load of each instance.
  using Loads = std::function<std::vector<fabric::InstanceLoad>()>;

  /// Throws std::runtime_error if the fabric cannot be used.
  InstanceHeartbeats(const fabric::dds::Participant& participant,
                     const boost::asio::any_io_executor& executor, Loads loads);

  /// Stops the heartbeats of an instance that has left.
  void forget(const fabric::InstanceId& instance) { heartbeats_.forget(instance); }

 private:
  void heartbeat();

  std::chrono::nanoseconds period_;
  Loads loads_;
  fabric::endpoints::HeartbeatEndpoint end_;
  fabric::registry::Heartbeats heartbeats_{fabric::InstanceId::random()};
  boost::asio::steady_timer timer_;
};

}  // namespace millrace::tools::replay
