// What Gateway keeps to itself: events of machines, fabric and operators go into the call control,
// and what the call control decides is carried out.
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
#include "fabric/ends/gateway_watch.hpp"
#include "fabric/ends/notice_end.hpp"
#include "gateway/control/call_control.hpp"
#include "gateway/control/lost_services.hpp"
#include "gateway/journal/journal.hpp"
#include "gateway/live/done_commands.hpp"
#include "gateway/live/gateway.hpp"
#include "gateway/live/plant_data.hpp"
#include "gateway/live/plant_variables.hpp"
#include "gateway/machines/machines.hpp"
#include "gateway/machines/stall_detector.hpp"
#include "gateway/queues/plant_queues.hpp"

namespace millrace::gateway::live {

/// As the log has it.
spdlog::level::level_enum level_of(Level level);
/// The least of them that this log writes.
Level least_of(const base::program::Log& log);

struct Gateway::Impl final : fabric::ends::CallEndListener,
                             fabric::ends::CommandListener,
                             fabric::ends::GatewayWatchListener,
                             machines::MachinesIo,
                             machines::MachinesListener,
                             queues::QueuesIo,
                             queues::QueueEvents {
  Impl(const boost::asio::any_io_executor& the_executor, SpinAfterPublish& the_spin,
       settings::Settings the_settings, base::program::Log the_log);

  void start();
  void change(const settings::Settings& wanted);
  void finish(std::function<void()> then);
  void end();

  /// To be called where an event begins. That this gateway stood still is an event of its own and
  /// comes first: others may have taken its machines over meanwhile.
  void begin_event();
  void on_stall(std::chrono::nanoseconds late);
  void beat();
  void tell_load();
  /// How often what was said once has happened since.
  void tell_left_out();
  void tell_calls();
  /// Raises what the gateway says of itself, or clears it if `text` is empty.
  void set_notice(const fabric::NoticeKey& key, const std::string& text, const std::string& advice);
  /// What is to be said of certificates for Secure ADS, now and as their ends come nearer.
  void tell_certificates();
  void notice_service(const fabric::InstanceIdentity& there);
  void notice_lost(const control::LostService& lost);
  void arm_timer();

  // What machines and message queues need.
  /// The only place of the gateway that reads a clock.
  [[nodiscard]] Moment now() const override;
  void after(std::chrono::nanoseconds delay, std::function<void()> act) override;
  std::unique_ptr<machines::Link> connect(const settings::MachineSettings& machine,
                                          machines::LinkEvents& events) override;
  void say(Level level, const std::string& text) override;

  // What happens on the machines.
  void on_link_up(const std::string& machine, const std::vector<std::uint16_t>& channels) override;
  void on_link_down(const std::string& machine, const std::string& reason) override;
  void on_link_dropped(const std::string& machine, const std::string& reason) override;
  void on_retired(const fabric::ChannelKey& key) override;
  void on_refused(const fabric::ChannelKey& key, const std::string& reason) override;
  void on_inherited(const fabric::ChannelStatus& status, const std::string& from) override;
  void on_contested() override;
  [[nodiscard]] std::vector<std::uint16_t> channels_of(const std::string& machine) const override;
  void on_machine_status(const fabric::MachineStatus& status) override;
  void on_machine_left(const fabric::MachineStatus& status) override;
  void on_read(const fabric::ChannelKey& key, const Snapshot& snapshot) override;
  void on_read_failed(const fabric::ChannelKey& key, const std::string& reason) override;
  void on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                const std::string& reason) override;
  void on_pushed(const fabric::ChannelKey& key, bool pushed) override;
  void on_change(const fabric::ChannelKey& key, Variable variable) override;

  // What message queues want; gateway_queues.cpp.
  std::unique_ptr<queues::QueueLink> reach(const std::string& machine,
                                           const queues::QueueSettings& queue) override;
  void on_queue_open(const fabric::ChannelKey& key) override;
  void on_queue_down(const fabric::ChannelKey& key, const std::string& reason) override;
  void on_queue_retired(const fabric::ChannelKey& key) override;
  void on_queue_read(const fabric::ChannelKey& key, const Snapshot& snapshot) override;
  void on_queue_write(const fabric::ChannelKey& key) override;
  void on_queue_change(const fabric::ChannelKey& key) override;
  void record_of_queue(const std::vector<JournalEntry>& entries, const Ticket& ticket) override;
  void say_of_queue(const fabric::ChannelKey& key, const queues::Queue::News& news) override;
  void tell_queue(const fabric::DataSample& sample) override;
  void warn_of_volatile_queues();

  void on_recorded(const Ticket& ticket);

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
  control::Verdict obey(const fabric::Command& command);
  void tell(const fabric::Outcome& outcome);
  /// What became of a variable that somebody wanted written.
  void tell(const variables::News::Written& written);

  // What the call control decides.
  void carry_out(control::ChannelActions actions);
  void carry_out(const fabric::ChannelKey& key, const Read& action);
  void carry_out(const fabric::ChannelKey& key, const Write& action);
  void carry_out(const fabric::ChannelKey&, const Record& action);
  void carry_out(const fabric::ChannelKey& key, const Publish& action);
  void carry_out(const fabric::ChannelKey& key, const Withdraw& action);
  void carry_out(const fabric::ChannelKey& key, const Tell& action);
  void carry_out(const fabric::ChannelKey& key, const Show& action);
  void carry_out(const fabric::ChannelKey& key, const Hide&);
  void carry_out(const fabric::ChannelKey& key, const Say& action);
  void carry_out(const fabric::ChannelKey& key, const WriteProblem& action);

  boost::asio::any_io_executor executor;
  /// What may be called after the gateway's end sees it gone.
  std::shared_ptr<int> life = std::make_shared<int>(0);
  SpinAfterPublish& spin;
  base::program::Log log;
  settings::Settings settings;
  std::unique_ptr<journal::Journal> journal;
  control::CallControl control;
  control::LostServices lost_services;
  boost::asio::steady_timer timer;
  std::optional<SteadyTime> armed;
  boost::asio::steady_timer last_chance;
  std::function<void()> finished;
  machines::StallDetector stall;
  boost::asio::steady_timer stall_timer;
  boost::asio::steady_timer load_timer;
  boost::asio::steady_timer certificate_timer;
  /// What was said of each last, by its subject.
  std::map<std::string, fabric::Notice> certificates_told;
  /// What the log has of calls, once a minute.
  control::CallCounts calls_told;
  SteadyTime calls_told_at = std::chrono::steady_clock::now();
  machines::GatewayIdentity own;
  fabric::dds::Participant participant;
  fabric::ends::CallEnd call_end;
  fabric::ends::CommandEnd command_end;
  fabric::ends::NoticeEnd notices;
  DoneCommands done_commands;
  /// What strangers may do ten thousand times a second is not told each time.
  fabric::Complaints complaints;
  fabric::Throttle instance_lines{1000, std::chrono::seconds(10)};
  fabric::ends::GatewayWatch watch;
  /// Before the machines, whose links it uses.
  PlantData data;
  PlantVariables variables;
  /// Of each machine, for its queues.
  std::map<std::string, std::weak_ptr<cnc::ads::Client>> clients;
  queues::PlantQueues queues;
  /// Of all links; before the machines, which have them.
  std::optional<machines::LinkGate> gate;
  machines::Machines machines;
};

}  // namespace millrace::gateway::live
