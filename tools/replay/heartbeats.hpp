// Heartbeats for the instances of a replay, as a service does for its own: gateways hear that they
// are there, and which calls they have.
//
//   InstanceHeartbeats heartbeats(participant, executor, [this] { return loads(); });      // heartbeats from here on
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
  /// What each instance is doing now.
  using Loads = std::function<std::vector<fabric::InstanceLoad>()>;

  /// Throws std::runtime_error if the fabric cannot be used.
  InstanceHeartbeats(const fabric::dds::Participant& participant,
                     const boost::asio::any_io_executor& executor, Loads loads);

  /// Of an instance that has left nothing is told any more.
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
