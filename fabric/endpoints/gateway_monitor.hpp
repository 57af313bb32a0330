// What gateways publish: which machines and channels they claim, and the state of those. This class
// decides which samples count: about a gateway, those of the participant that used its id first;
// about a channel, those of the gateway that claims its machine, of several gateways the one that
// claimed it first. So a machine can be taken over once its gateway is gone, and not before.
//
//   GatewayMonitor monitor(participant, executor, listener);
//   monitor.subscribe_channels();                 // from now on also their channels
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/any_io_executor.hpp>

#include "fabric/dds/participant.hpp"
#include "fabric/messages.hpp"
#include "fabric/registry/instance_registry.hpp"

namespace millrace::fabric::endpoints {

/// How a gateway left a machine.
enum class Absence : std::uint8_t {
  /// The machine is no longer in its configuration.
  removed,
  /// It gave the machine up, or its process has left DDS in order.
  ended,
  /// DDS knows its process, which sends nothing: it stands still, or was killed just now, or its
  /// host cannot be reached. It comes back, or becomes `gone`.
  silent,
  /// It was silent, and DDS has removed its process.
  gone
};

/// Called on the executor, one at a time.
class GatewayMonitorListener {
 public:
  virtual ~GatewayMonitorListener() = default;
  virtual void on_machine(const MachineStatus& status) = 0;
  /// The gateway is there no longer for this machine; after `silent`, a second time with what
  /// became of it.
  virtual void on_machine_gone(const std::string& machine, const InstanceId& gateway,
                               Absence absence) = 0;
  virtual void on_channel(const ChannelStatus& status) = 0;
  /// No gateway publishes the channel any more.
  virtual void on_channel_gone(const ChannelKey& key) { static_cast<void>(key); }
  /// A participant publishes in the name of a gateway; at most once a minute for each.
  virtual void on_ignored(const std::string& reason) { static_cast<void>(reason); }
};

class GatewayMonitor {
 public:
  /// The gateways whose samples are passed on.
  enum class Of : std::uint8_t { others, all };

  /// Throws std::runtime_error with Cyclone's reason.
  GatewayMonitor(dds::Participant& participant, boost::asio::any_io_executor executor,
                 GatewayMonitorListener& listener, Of of = Of::others);
  ~GatewayMonitor();
  GatewayMonitor(const GatewayMonitor&) = delete;
  GatewayMonitor& operator=(const GatewayMonitor&) = delete;

  /// Also passes on channels, now and when they change; costs a little with each call on the
  /// fabric.
  void subscribe_channels();
  /// Passes on what has arrived since the last call.
  void drain();

  /// The participant, as samples of built-in topics name it, is this gateway.
  [[nodiscard]] bool is_gateway(registry::EndpointHandle participant,
                                const InstanceId& gateway) const;
  /// The participant is a gateway that claims this machine, or that of this queue.
  [[nodiscard]] bool claims(registry::EndpointHandle participant, const std::string& machine) const;
  /// The participant is the gateway of the machine whose calls have this epoch; nullopt: no gateway
  /// has.
  [[nodiscard]] std::optional<bool> has_epoch(registry::EndpointHandle participant,
                                              const std::string& machine,
                                              std::uint64_t epoch) const;
  /// Samples that were lost before they arrived.
  [[nodiscard]] std::uint64_t lost() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::fabric::endpoints
