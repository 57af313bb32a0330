// Calls and events of the fabric, shown on LCM as they come.
//
//   MirrorThread mirror(participant, config, host.socket(), log);
#pragma once

#include <memory>

#include "base/program/log.hpp"
#include "fabric/dds/participant.hpp"
#include "services/lcm/config.hpp"
#include "services/lcm/socket.hpp"

namespace millrace::services::lcm {

/// Observes on a thread of its own.
class MirrorThread {
 public:
  /// `participant` hears everybody (fabric::dds::Finding); that of the services only announces
  /// itself. Both it and `socket` outlive this. Throws std::runtime_error with Cyclone's reason.
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
