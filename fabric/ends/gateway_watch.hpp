// What other gateways say: which machines and channels they claim, and what goes on in those.
//
//   GatewayWatch watch(participant, executor, listener);
//   watch.watch_channels();                 // from now on also their channels
#pragma once

#include <memory>

#include <boost/asio/any_io_executor.hpp>

#include "fabric/dds/participant.hpp"
#include "fabric/messages.hpp"

namespace millrace::fabric::ends {

/// Called on the executor, one at a time. What this participant says is not heard.
class GatewayWatchListener {
 public:
  virtual ~GatewayWatchListener() = default;
  virtual void on_machine(const MachineStatus& status) = 0;
  /// The gateway has let go of the machine, or is gone, or is taken for gone.
  virtual void on_machine_gone(const std::string& machine, const InstanceId& gateway) = 0;
  virtual void on_channel(const ChannelStatus& status) = 0;
};

class GatewayWatch {
 public:
  /// Throws std::runtime_error with Cyclone's reason.
  GatewayWatch(dds::Participant& participant, boost::asio::any_io_executor executor,
               GatewayWatchListener& listener);
  ~GatewayWatch();
  GatewayWatch(const GatewayWatch&) = delete;
  GatewayWatch& operator=(const GatewayWatch&) = delete;

  /// Listens to channels too, as they are now and as they change; costs a little with each call on
  /// the fabric.
  void watch_channels();

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::fabric::ends
