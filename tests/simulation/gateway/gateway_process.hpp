// A gateway: the real core and the real journal writer between simulated ports.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/core/core.hpp"
#include "gateway/journal/journal_writer.hpp"
#include "tests/simulation/fabric/member.hpp"
#include "tests/simulation/gateway/ads_link.hpp"
#include "tests/simulation/gateway/bug.hpp"
#include "tests/simulation/gateway/disk.hpp"
#include "tests/simulation/gateway/gateway_checker.hpp"
#include "tests/simulation/gateway/mistakes.hpp"

namespace millrace::tests::simulation {

/// The machines and policies of its configuration file.
struct GatewayFile {
  std::vector<gateway::settings::MachineSettings> machines;
  gateway::Policies policies;
};

struct GatewayPlan {
  GatewayNumber number = 0;
  GatewayFile file;
  gateway::journal::FileOptions journal;
  /// It has no journal folder: a restart forgets everything.
  bool in_memory = false;
  /// It detects its own pauses. Without this it has no timer of its own, which a walk that counts
  /// timers needs.
  bool watches_itself = true;
  Bug bug = Bug::none;
};

class GatewayProcess final : public Member,
                             private GatewayListener,
                             private GatewayMonitorListener,
                             private gateway::core::Fabric,
                             private gateway::core::Host,
                             public gateway::machines::ControllerEvents,
                             public LinkObserver {
 public:
  GatewayProcess(GatewayPlan plan, Agenda& agenda, Party party, History& history,
                 simulation::Fabric& fabric, Random random);

  /// Connects it to this machine over this conditions, which outlives it.
  void plug(Controller& controller, LinkConditions& conditions);

  void start();
  /// kill -9, or a power cut of its host.
  void kill(bool power);
  /// SIGTERM: it ends once the present answers are written, or after two seconds.
  void stop();
  /// Changes its file, and sends SIGHUP if it runs.
  void reload(GatewayFile file);
  void cut_links(const std::string& machine, const std::string& reason);

  [[nodiscard]] GatewayNumber number() const { return plan_.number; }
  /// Counts its runs.
  [[nodiscard]] std::uint64_t life() const { return process().life(); }
  [[nodiscard]] const GatewayFile& file() const { return plan_.file; }
  Disk& disk() { return disk_; }

  /// What has arrived from the fabric; for a walk through all orders.
  [[nodiscard]] std::string hearing() const { return end() ? fabric().place_of(*end()) : ""; }

  /// A request about variables arrives while it runs.
  void ask(const fabric::VariableRequest& request);
  std::function<void(const fabric::VariableReply&)> on_variable_reply;
  /// With the length of its last pause.
  std::function<void(const fabric::DataSample&, Time)> on_sample;

  /// What an operator sees and can do.
  [[nodiscard]] const std::map<Key, fabric::ChannelStatus>& statuses() const { return statuses_; }
  [[nodiscard]] const GatewayChecker& checker() const { return checker_; }
  void answer(const Key& key, const fabric::CallId& call);
  void retry(const Key& key, const fabric::CallId& call);
  /// The number of unanswered messages in its queues, and of calls that are open in the journal; 0
  /// while it does not run.
  [[nodiscard]] std::size_t waiting_messages() const;
  [[nodiscard]] std::size_t open_calls() const;
  /// It serves the channel now.
  [[nodiscard]] bool serves(const Key& key) const { return served_.contains(key); }
  /// How often it has left the channel, for example to another gateway.
  [[nodiscard]] unsigned times_left(const Key& key) const {
    const auto found = times_left_.find(key);
    return found == times_left_.end() ? 0 : found->second;
  }
  /// It has started with less than it had journalled: a program may wait for an answer to a call
  /// that no gateway remembers.
  [[nodiscard]] bool lost_memory() const { return lost_memory_; }

 private:
  class WatchedLink;
  class WatchedCore;

  // From the fabric.
  void on_instance_ready(const fabric::InstanceIdentity& instance) override;
  void on_instance_changed(const fabric::InstanceIdentity& instance) override;
  void on_instance_gone(const fabric::InstanceId& instance) override;
  void on_load(const fabric::InstanceLoad& load) override;
  void on_reply(const fabric::Reply& reply) override;
  void on_stranger(const fabric::Reply& reply) override;
  // From other gateways.
  void on_machine(const fabric::MachineStatus& status) override;
  void on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway) override;
  void on_channel(const fabric::ChannelStatus& status) override;
  // From its links, on the way to the core.
  void on_link_up(const std::string& machine, const std::vector<std::uint16_t>& channels) override;
  void on_link_down(const std::string& machine, const gateway::machines::LinkLoss& loss) override;
  void on_read(const Key& key, const gateway::ServiceSnapshot& snapshot) override;
  void on_read_failed(const Key& key, const fabric::Message& reason) override;
  void on_write(const Key& key, gateway::WriteOutcome outcome,
                const fabric::Message& reason) override;
  void on_subscribed(const std::string& machine,
                     const std::vector<gateway::machines::SubscribeOutcome>& outcomes) override;
  void on_notification(const Key& key, gateway::Variable variable,
                       std::optional<std::uint32_t> value) override;
  void on_answer(const std::string& machine, const gateway::machines::Answer& answer) override;
  void on_queue_answer(const Key& queue, gateway::queues::StepAnswer answer) override;
  void on_queue_event(const Key& queue) override;
  // Observations of a link.
  void on_looked(Time first) override { looked_from_ = first; }
  AdsWrite describe(const Key& key, gateway::Variable variable,
                    const gateway::Value& value) override {
    return checker_.describe(key, variable, value);
  }

  // Ports; gateway_ports.cpp.
  void publish(const fabric::Request& request) override;
  void publish(const fabric::Event& event) override;
  void publish(const fabric::ChannelStatus& status) override;
  void publish(const fabric::MachineStatus& status) override;
  void publish(const fabric::DataSample& sample) override;
  void publish(const fabric::ProgramEvent&) override {}
  void publish(const fabric::InstanceId& requester, const fabric::VariableReply& reply) override;
  void publish(const fabric::Outcome&) override {}
  void dispose(const fabric::DataSample&) override {}
  void dispose(const fabric::RequestKey& request) override;
  void dispose(const Key& status) override;
  void dispose(const fabric::MachineStatus& status) override;
  [[nodiscard]] bool awaits_authentication() const override { return false; }
  void subscribe_channels() override;
  [[nodiscard]] gateway::Moment now() const override;
  void wake_at(std::optional<gateway::SteadyTime> time) override;
  std::unique_ptr<gateway::machines::Controller> connect(
      const gateway::settings::MachineSettings& machine) override;
  void append(const gateway::JournalEntry& entry, const gateway::Ticket& ticket) override;
  void log(gateway::Level level, const std::string& text) override;
  void set_alarm(const fabric::AlarmKey& key, const fabric::Message& text,
                 const fabric::Message& advice) override;
  void may_end(bool half_written) override;

  std::unique_ptr<gateway::core::Core> make_core(const gateway::core::GatewayIdentity& own);
  void on_recorded(const gateway::Ticket& ticket);
  void tick();
  void heartbeat();
  void read_file();
  void forget();
  void served_no_more(const std::string& machine);
  void leaves(const Key& key);
  void leaves_all_of(const std::string& machine);
  /// The link to the machine, unless the gateway has removed it.
  [[nodiscard]] std::shared_ptr<AdsLink> link_to(const std::string& machine) const;

  GatewayPlan plan_;
  Random random_;
  Disk disk_;
  GatewayChecker checker_;
  Mistakes mistakes_;
  struct Machine {
    Controller* controller;
    LinkConditions* conditions;
  };
  std::map<std::string, Machine> plugged_;

  // Of this run of the process.
  std::optional<gateway::journal::JournalWriter> journal_writer_;
  std::unique_ptr<gateway::core::Core> core_;
  std::map<std::string, std::weak_ptr<AdsLink>> links_;
  /// Counts the wake-ups that wake_at() has planned.
  std::uint64_t wakes_ = 0;
  bool ending_ = false;
  unsigned heartbeats_to_end_ = 0;
  bool in_trouble_ = false;
  /// The call that an operator wants to be dispatched again.
  fabric::CallId retrying_{};
  Time looked_from_{};
  /// The channels in its last on_serve.
  std::set<Key> served_;
  std::map<Key, unsigned> times_left_;

  bool lost_memory_ = false;
  /// Offset of the steady clock of its host.
  Time booted_{};
  std::map<Key, fabric::ChannelStatus> statuses_;
};

}  // namespace millrace::tests::simulation
