// Sends calls and events of the fabric on LCM as they happen.
//
//   MirrorThread mirror(participant, config, host.socket(), log);
#pragma once

#include <memory>

#include "base/program/log.hpp"
#include "fabric/dds/participant.hpp"
#include "services/lcm/config.hpp"
#include "services/lcm/socket.hpp"

namespace millrace::services::lcm {

/// Observes on its own thread.
class MirrorThread {
 public:
  /// `participant` discovers all others (fabric::dds::Finding); that of the services only announces
  /// itself. It and `socket` must outlive this. Throws std::runtime_error with Cyclone's reason.
  MirrorThread(fabric::dds::Participant& participant, Mirror mirror, Socket& socket,
               base::program::Log log);
  ~MirrorThread();
  MirrorThread(const MirrorThread&) = delete;
  MirrorThread& operator=(const MirrorThread&) = delete;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::services::lcm
