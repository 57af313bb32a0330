// The endpoint of a process with instances: publishes that it runs, and the load of its instances.
//
//   HeartbeatEndpoint end(participant);
//   end.publish({.process = process, .at = now, .loads = …});      // four times in the lease
#pragma once

#include <string>

#include <tl/expected.hpp>

#include "fabric/dds/participant.hpp"
#include "fabric/wire/writer.hpp"

namespace millrace::fabric::endpoints {

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
