#include "tools/replay/heartbeats.hpp"

#include <algorithm>
#include <utility>

namespace millrace::tools::replay {

InstanceHeartbeats::InstanceHeartbeats(const fabric::dds::Participant& participant,
                                       const boost::asio::any_io_executor& executor, Loads loads)
    : period_(std::chrono::nanoseconds(participant.options().lease) /
              fabric::endpoints::HeartbeatEndpoint::heartbeats_per_lease),
      loads_(std::move(loads)),
      end_(participant),
      timer_(executor, std::chrono::steady_clock::now()) {
  heartbeat();
}

void InstanceHeartbeats::heartbeat() {
  for (const fabric::InstanceLoad& load : loads_()) {
    heartbeats_.note(load);
  }
  // Losing one heartbeat is harmless.
  static_cast<void>(end_.publish(heartbeats_.next(std::chrono::system_clock::now())));
  // Missed heartbeats are not sent later.
  timer_.expires_at(std::max(timer_.expiry() + period_, std::chrono::steady_clock::now()));
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      heartbeat();
    }
  });
}

}  // namespace millrace::tools::replay
