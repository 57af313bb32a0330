// What Gateway keeps to itself: hands the core what comes from machines, fabric and operators, and
// is its ports.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <boost/asio/steady_timer.hpp>

#include "fabric/complaints.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/ends/call_end.hpp"
#include "fabric/ends/command_end.hpp"
#include "fabric/ends/data_end.hpp"
#include "fabric/ends/gateway_watch.hpp"
#include "fabric/ends/notice_end.hpp"
#include "fabric/ends/variable_end.hpp"
#include "gateway/core/core.hpp"
#include "gateway/core/lost_services.hpp"
#include "gateway/journal/journal.hpp"
#include "gateway/shell/command_history.hpp"
#include "gateway/shell/gateway.hpp"

namespace millrace::gateway::shell {

/// As the log has it.
spdlog::level::level_enum level_of(Level level);
/// The least of them that this log writes.
Level min_level_of(const base::program::Log& logger);

struct Gateway::Impl final : fabric::ends::CallEndListener,
                             fabric::ends::CommandListener,
                             fabric::ends::GatewayWatchListener,
                             core::Fabric,
                             core::Host {
  Impl(const boost::asio::any_io_executor& the_executor, SpinAfterPublish& the_spin,
       settings::Settings the_settings, base::program::Log the_log);

  void start();
  void change(const settings::Settings& wanted);
  void finish(std::function<void()> then);
  void heartbeat();
  void publish_load();
  /// How often what was said once has happened since.
  void log_left_out();
  void log_calls();
  /// What is to be said of certificates for Secure ADS, now and as their ends come nearer.
  void publish_certificates();
  void notice_service(const fabric::InstanceIdentity& there);
  void notice_lost(const core::LostService& lost);
  void warn_of_queues();

  // Fabric; gateway_ports.cpp.
  void publish(const fabric::Request& request) override;
  void publish(const fabric::Event& event) override;
  void publish(const fabric::ChannelStatus& status) override;
  void publish(const fabric::MachineStatus& status) override;
  void publish(const fabric::DataSample& sample) override;
  void publish(const fabric::ProgramEvent& event) override;
  void publish(const fabric::InstanceId& asker, const fabric::VariableReply& reply) override;
  void publish(const fabric::Outcome& outcome) override;
  void dispose(const fabric::RequestKey& request) override;
  void dispose(const fabric::ChannelKey& status) override;
  void dispose(const fabric::MachineStatus& status) override;
  void dispose(const fabric::DataSample& sample) override;
  void watch_channels() override;

  // Host; gateway_ports.cpp.
  /// The only place of the gateway that reads a clock.
  [[nodiscard]] Moment now() const override;
  void wake_at(std::optional<SteadyTime> time) override;
  std::unique_ptr<machines::Controller> connect(const settings::MachineSettings& machine) override;
  void append(const JournalEntry& entry, const Ticket& ticket) override;
  void log(Level level, const std::string& text) override;
  void notice(const fabric::NoticeKey& key, const std::string& text,
              const std::string& advice) override;
  void may_end(bool half_written) override;

  // What other gateways say.
  void on_machine(const fabric::MachineStatus& status) override;
  void on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway) override;
  void on_channel(const fabric::ChannelStatus& status) override;

  // What happens on the fabric.
  void on_instance_ready(const fabric::InstanceIdentity& instance) override;
  void on_instance_changed(const fabric::InstanceIdentity& instance) override;
  void on_instance_gone(const fabric::InstanceId& instance) override;
  void on_load(const fabric::InstanceLoad& load) override;
  void on_reply(const fabric::Reply& reply) override;
  void on_readers(bool of_channels, bool of_events) override;
  void on_ignored(const std::string& reason) override;

  // What an operator wants. Commands for channels of others are theirs.
  void on_command(const fabric::Command& command) override;
  core::CommandResult execute(const fabric::Command& command);
  fabric::ends::DataEnd& data_end();

  boost::asio::any_io_executor executor;
  SpinAfterPublish& spin;
  base::program::Log logger;
  settings::Settings settings;
  std::unique_ptr<journal::Journal> journal;
  core::LostServices lost_services;
  boost::asio::steady_timer timer;
  std::optional<SteadyTime> armed;
  std::function<void()> finished;
  boost::asio::steady_timer heartbeat_timer;
  boost::asio::steady_timer load_timer;
  boost::asio::steady_timer certificate_timer;
  /// What was said of each last, by its subject.
  std::map<std::string, fabric::Notice> certificates_published;
  /// What the log has of calls, once a minute.
  core::CallCounts calls_logged;
  SteadyTime calls_logged_at = std::chrono::steady_clock::now();
  core::GatewayIdentity own;
  fabric::dds::Participant participant;
  fabric::ends::CallEnd call_end;
  fabric::ends::CommandEnd command_end;
  fabric::ends::NoticeEnd notices;
  CommandHistory command_history;
  /// What strangers may do ten thousand times a second is not told each time.
  fabric::Complaints complaints;
  fabric::Throttle instance_lines{1000, std::chrono::seconds(10)};
  fabric::ends::GatewayWatch watch;
  /// Once there is something to tell: until then nobody on the fabric hears of these writers.
  std::optional<fabric::ends::DataEnd> data;
  core::Core core;
  /// The last, so that nobody asks a core that is half made or half gone.
  fabric::ends::VariableAnswerEnd variables;
};

}  // namespace millrace::gateway::shell
