// A process with services, as a participant of its fabric: one participant and one loop, for any
// number of services.
//
//   auto participant = std::make_shared<SharedParticipant>(join, log);
//   Service first({.uuid = "560aacbf-…", .participant = participant}, root, log);
//   Service second({.uuid = "9f1c…", .participant = participant}, gauge, log);
//
// A service that is given none makes one of its own.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "fabric/dds/participant.hpp"
#include "fabric/messages.hpp"

namespace boost::asio {
class io_context;
}
namespace spdlog {
class logger;
}

namespace millrace::services::sdk {

/// An instance of this process. Called on the participant's loop.
class HostedInstance {
 public:
  virtual ~HostedInstance() = default;
  [[nodiscard]] virtual fabric::InstanceLoad load() const = 0;
  /// The instance must leave: `issuer` has commanded it, or, if that is empty, its own process.
  virtual void on_drain(const std::string& issuer) = 0;
};

/// RAII. Its loop sends heartbeats, receives commands, and tells the supervisor that it runs. From
/// any thread.
class SharedParticipant {
 public:
  /// Throws std::runtime_error if the fabric cannot be joined. A process that also calls services
  /// or observes its fabric sets `discovers`: participants of one process share their discovery
  /// settings.
  SharedParticipant(const fabric::dds::ParticipantOptions& join,
                    std::shared_ptr<spdlog::logger> log,
                    fabric::dds::Finding finding = fabric::dds::Finding::announces);
  /// After the instances have left.
  ~SharedParticipant();
  SharedParticipant(const SharedParticipant&) = delete;
  SharedParticipant& operator=(const SharedParticipant&) = delete;

  // The following is for instances (services/sdk/instance.hpp).

  [[nodiscard]] fabric::dds::Participant& participant();
  [[nodiscard]] boost::asio::io_context& loop();
  /// An instance has got a request: the next heartbeat waits no longer than that of a busy process.
  void requested();
  /// From now on it has heartbeats, and gets its commands.
  void add_instance(const fabric::InstanceId& id, HostedInstance& hosted);
  /// Calls its on_drain(). Without effect if it has left.
  void drain(const fabric::InstanceId& id);
  /// After this returns nothing is called any more; `last` runs on the loop before.
  void remove_instance(const fabric::InstanceId& id, const std::function<void()>& last);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::services::sdk
