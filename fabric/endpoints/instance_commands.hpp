// The commands of an operator for instances, and their outcomes: ping and drain. For processes with
// one instance or several.
//
//   InstanceCommands commands(participant, executor, listener);
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/any_io_executor.hpp>

#include "fabric/endpoints/command_endpoint.hpp"

namespace millrace::fabric::endpoints {

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
