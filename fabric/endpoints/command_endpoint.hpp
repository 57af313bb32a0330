// The endpoint that receives commands: of a gateway or an instance.
//
//   CommandEndpoint end(participant, executor, listener);
//   void on_command(const Command& command) {
//     if (command.kind != CommandKind::drain || command.instance != mine) return;   // not for us
//     …
//     end.publish({.responder = mine, .command = command.id, .done = true});
//   }
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
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
  std::unique_ptr<Impl> impl_;
};

/// This participant, as in samples of built-in topics, was a receiver of the command: its instance,
/// its gateway or a machine of it. So it may publish the outcome.
bool is_for(registry::EndpointHandle participant, const Command& command,
            const registry::InstanceRegistry& instances, const GatewayMonitor& gateways);

// The commands of an operator for instances, and their outcomes: ping and drain. For processes with
// one instance or several.
//
//   InstanceCommands commands(participant, executor, listener);

/// Called on the executor, one at a time.
class InstanceCommandsListener {
 public:
  virtual ~InstanceCommandsListener() = default;
  /// The calls that the instance runs; nullopt if it is not one of this process.
  [[nodiscard]] virtual std::optional<std::uint32_t> running(const InstanceId& instance) const = 0;
  /// Finish the running calls, accept no new ones, leave; `issuer` commands it.
  virtual void on_drain(const InstanceId& instance, const std::string& issuer) = 0;
  /// The outcome did not reach the issuer, and why.
  virtual void on_unreported(const Command& command, const std::string& reason) = 0;
};

/// RAII; use and end it on the executor.
class InstanceCommands : private CommandListener {
 public:
  /// Gateways learn in about a millisecond that an instance drains; requests that they published
  /// until then arrive within this time and are still run.
  static constexpr std::chrono::milliseconds drain_grace{100};

  /// Throws std::runtime_error with Cyclone's reason.
  InstanceCommands(dds::Participant& participant, const boost::asio::any_io_executor& executor,
                   InstanceCommandsListener& listener);

 private:
  void on_command(const Command& command) override;

  InstanceCommandsListener& listener_;
  CommandEndpoint end_;
};

}  // namespace millrace::fabric::endpoints
