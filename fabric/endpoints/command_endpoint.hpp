// The endpoint that receives commands: of a gateway or an instance.
//
//   CommandEndpoint end(participant, executor, listener);
//   void on_command(const Command& command) {
//     if (command.kind != CommandKind::drain || command.instance != mine) return;   // not for us
//     …
//     end.publish({.responder = mine, .command = command.id, .done = true});
//   }
#pragma once

#include <memory>
#include <string>

#include <boost/asio/any_io_executor.hpp>
#include <tl/expected.hpp>

#include "fabric/command.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/endpoints/gateway_monitor.hpp"
#include "fabric/registry/instance_registry.hpp"

namespace millrace::fabric::endpoints {

/// Called on the executor, one at a time.
class CommandListener {
 public:
  virtual ~CommandListener() = default;
  /// Any command on the fabric, for any receiver; a repeated one is passed on once.
  virtual void on_command(const Command& command) = 0;
};

class CommandEndpoint {
 public:
  CommandEndpoint(dds::Participant& participant, const boost::asio::any_io_executor& executor,
                  CommandListener& listener);
  ~CommandEndpoint();
  CommandEndpoint(const CommandEndpoint&) = delete;
  CommandEndpoint& operator=(const CommandEndpoint&) = delete;

  /// Publishes how a command ended. Fails for a detail over 255 bytes.
  tl::expected<void, std::string> publish(const Outcome& outcome);

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

/// This participant, as in samples of built-in topics, was a receiver of the command: its instance,
/// its gateway or a machine of it. So it may publish the outcome.
bool is_for(registry::EndpointHandle participant, const Command& command,
            const registry::InstanceRegistry& instances, const GatewayMonitor& gateways);

}  // namespace millrace::fabric::endpoints
