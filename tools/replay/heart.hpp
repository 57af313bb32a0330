// Beats for the instances of a replay, as a service does for its own: gateways hear that they are
// there, and which calls they have.
//
//   Heart heart(participant, executor, [this] { return loads(); });      // beats from here on
#pragma once

#include <functional>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

#include "fabric/dds/participant.hpp"
#include "fabric/ends/beat_end.hpp"
#include "fabric/registry/beats.hpp"

namespace millrace::tools::replay {

/// Lives on the executor, which runs one thing at a time.
class Heart {
 public:
  /// What each instance is doing now.
  using Loads = std::function<std::vector<fabric::InstanceLoad>()>;

  /// Throws std::runtime_error if the fabric cannot be used.
  Heart(const fabric::dds::Participant& participant, const boost::asio::any_io_executor& executor,
        Loads loads);

  /// Of an instance that has left nothing is told any more.
  void forget(const fabric::InstanceId& instance) { beats_.forget(instance); }

 private:
  void beat();

  std::chrono::nanoseconds period_;
  Loads loads_;
  fabric::ends::BeatEnd end_;
  fabric::registry::Beats beats_{fabric::InstanceId::random()};
  boost::asio::steady_timer timer_;
};

}  // namespace millrace::tools::replay
