// The LCM processes on the fabric: carries out the decisions of the bridge.
//
//   Host host(config, options, log);
//   host.run();       // until stop() was called and the running calls are answered
#pragma once

#include <memory>

#include "base/program/log.hpp"
#include "fabric/dds/participant.hpp"
#include "services/lcm/config.hpp"
#include "services/lcm/socket.hpp"
#include "services/sdk/service.hpp"

namespace millrace::services::lcm {

class Host {
 public:
  /// `base`: the participant of all instances, and their version. Throws std::runtime_error if
  /// joining LCM's group fails.
  Host(const Config& config, sdk::ServiceOptions base, base::program::Log log);
  ~Host();
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  /// Call it once.
  void run();
  /// Takes no new call, and ends run() when the running calls are answered. From any thread.
  void stop();

  /// For other senders on LCM; from any thread.
  [[nodiscard]] Socket& socket();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Sends calls and events of the fabric on LCM as they happen.
//
//   MirrorThread mirror(participant, config, host.socket(), log);

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
