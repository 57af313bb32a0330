// The running gateway: executes the core's decisions on one io_context. It passes events of
// machines, fabric and operators to the core, and implements its ports.
//
//   SpinAfterPublish spin;
//   Gateway gateway(io.get_executor(), spin, settings, log);   // joins the fabric
//   gateway.start();                                       // begins to connect to the machines
//   spin.run(io, [] { return false; });
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

#include "base/program/log.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/endpoints/alarm_endpoint.hpp"
#include "fabric/endpoints/call_endpoint.hpp"
#include "fabric/endpoints/command_endpoint.hpp"
#include "fabric/endpoints/data_endpoint.hpp"
#include "fabric/endpoints/gateway_monitor.hpp"
#include "fabric/endpoints/variable_endpoints.hpp"
#include "fabric/log_limiter.hpp"
#include "gateway/core/core.hpp"
#include "gateway/journal/journal.hpp"
#include "gateway/settings/settings.hpp"
#include "gateway/shell/alarms.hpp"
#include "gateway/shell/command_history.hpp"
#include "gateway/shell/spin_after_publish.hpp"
#include "gateway/shell/wake_timer.hpp"

namespace millrace::gateway::shell {

/// The corresponding level of the log.
spdlog::level::level_enum level_of(Level level);
/// The lowest level that this log writes.
Level min_level_of(const base::program::Log& log);

class Gateway final : fabric::endpoints::CallEndpointListener,
                      fabric::endpoints::CommandListener,
                      fabric::endpoints::GatewayMonitorListener,
                      core::Fabric,
                      core::Host {
 public:
  /// Throws std::runtime_error if the fabric cannot be joined or the journal not be used.
  Gateway(const boost::asio::any_io_executor& executor, SpinAfterPublish& spin,
          const settings::Settings& settings, base::program::Log log);
  Gateway(const Gateway&) = delete;
  Gateway& operator=(const Gateway&) = delete;

  void start();
  /// Takes over machines and policies; running calls continue with the old ones. The journal and
  /// the fabric stay the same until the gateway is restarted.
  void change(const settings::Settings& settings);
  /// Publishes an alarm, until the next change(): this configuration file is wrong, and the next
  /// start would fail.
  void refuse(const std::string& file, const std::string& why);
  /// Accepts no new call and calls `finished` once every started response is written: at once, or
  /// after two seconds at the latest.
  void finish(std::function<void()> finished);

 private:
  void heartbeat();
  void publish_load();
  void log_calls();
  /// Publishes the alarms of certificates for Secure ADS, now and as they near their expiry.
  void publish_certificates();
  void warn_of_queues();

  // Fabric; gateway_ports.cpp.
  void publish(const fabric::Request& request) override;
  void publish(const fabric::Event& event) override;
  void publish(const fabric::ChannelStatus& status) override;
  void publish(const fabric::MachineStatus& status) override;
  void publish(const fabric::DataSample& sample) override;
  void publish(const fabric::ProgramEvent& event) override;
  void publish(const fabric::InstanceId& requester, const fabric::VariableReply& reply) override;
  void publish(const fabric::Outcome& outcome) override;
  void dispose(const fabric::RequestKey& request) override;
  void dispose(const fabric::ChannelKey& status) override;
  void dispose(const fabric::MachineStatus& status) override;
  void dispose(const fabric::DataSample& sample) override;
  [[nodiscard]] bool awaits_authentication() const override;
  void subscribe_channels() override;

  // Host; gateway_ports.cpp.
  /// The only place of the gateway that reads a clock.
  [[nodiscard]] Moment now() const override;
  void wake_at(std::optional<SteadyTime> time) override;
  std::unique_ptr<machines::Controller> connect(const settings::MachineSettings& machine) override;
  void append(const JournalEntry& entry, const Ticket& ticket) override;
  void log(Level level, const std::string& text) override;
  void set_alarm(const fabric::AlarmKey& key, const fabric::Message& text,
                 const fabric::Message& advice) override;
  void may_end(bool half_written) override;

  // Samples of other gateways.
  void on_machine(const fabric::MachineStatus& status) override;
  void on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway,
                       fabric::endpoints::Absence absence) override;
  void on_channel(const fabric::ChannelStatus& status) override;

  // Events of the fabric.
  void on_instance_ready(const fabric::InstanceIdentity& instance) override;
  void on_instance_changed(const fabric::InstanceIdentity& instance) override;
  void on_instance_gone(const fabric::InstanceId& instance) override;
  void on_load(const fabric::InstanceLoad& load) override;
  void on_reply(const fabric::Reply& reply) override;
  void on_readers(bool of_channels, bool of_events) override;
  void on_ignored(const std::string& reason) override;

  // Commands of operators. Commands for channels of other gateways are ignored.
  void on_command(const fabric::Command& command) override;
  core::CommandResult execute(const fabric::Command& command);
  fabric::endpoints::DataEndpoint& data_endpoint();

  struct Timers {
    WakeTimer wake;
    boost::asio::steady_timer heartbeat;
    boost::asio::steady_timer load;
    boost::asio::steady_timer certificates;
  };
  /// What the gateway has on the fabric.
  struct Endpoints {
    Endpoints(const boost::asio::any_io_executor& executor, const settings::Settings& settings,
              const journal::Journal& journal, Gateway& gateway);

    fabric::dds::Participant participant;
    core::GatewayIdentity own;
    fabric::endpoints::CallEndpoint calls;
    fabric::endpoints::CommandEndpoint commands;
    CommandHistory command_history{};
    fabric::endpoints::AlarmEndpoint alarms;
    fabric::endpoints::GatewayMonitor gateways;
    /// Created with the first sample: until then these writers do not exist on the fabric.
    std::optional<fabric::endpoints::DataEndpoint> data{};
  };
  /// The calls as of the last log line, once a minute.
  struct LoggedCalls {
    core::CallCounts counts{};
    SteadyTime at = std::chrono::steady_clock::now();
  };

  SpinAfterPublish& spin_;
  base::program::Log log_;
  settings::Settings settings_;
  std::unique_ptr<journal::Journal> journal_;
  Timers timers_;
  std::function<void()> finished_;
  LoggedCalls logged_calls_;
  /// A warning that a stranger can cause ten thousand times a second is limited.
  fabric::LogLimiter log_limiter_;
  Endpoints fabric_;
  GatewayAlarms alarms_;
  core::Core core_;
  /// Last, so that no request reaches a core that is half built or half destroyed.
  fabric::endpoints::VariableReplyEndpoint variables_;
};

}  // namespace millrace::gateway::shell
