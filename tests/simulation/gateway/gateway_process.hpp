// A gateway: the real call control, the real choice of machines and the real journal keeper. The
// simulation brings the events and carries out the actions, as gateway/live does with sockets.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/control/call_control.hpp"
#include "gateway/journal/keeper.hpp"
#include "gateway/machines/machines.hpp"
#include "gateway/machines/stall_detector.hpp"
#include "gateway/queues/plant_queues.hpp"
#include "tests/simulation/fabric/member.hpp"
#include "tests/simulation/gateway/ads_link.hpp"
#include "tests/simulation/gateway/bug.hpp"
#include "tests/simulation/gateway/disk.hpp"
#include "tests/simulation/gateway/mistakes.hpp"
#include "tests/simulation/gateway/witness.hpp"

namespace millrace::tests::simulation {

/// What its configuration file says of machines and policies.
struct GatewayFile {
  std::vector<gateway::settings::MachineSettings> machines;
  gateway::Policies policies;
};

struct GatewayPlan {
  GatewayNumber number = 0;
  GatewayFile file;
  gateway::journal::FileOptions journal;
  /// It has no journal folder: a restart forgets all.
  bool in_memory = false;
  /// It watches whether it stood still; without, no timer of its own disturbs who counts them.
  bool watches_itself = true;
  Bug bug = Bug::none;
};

class GatewayProcess final : public Member,
                             private GatewayListener,
                             private GatewayWatchListener,
                             public gateway::machines::MachinesIo,
                             public gateway::machines::MachinesListener,
                             public gateway::queues::QueuesIo,
                             public gateway::queues::QueueEvents,
                             public LinkObserver {
 public:
  GatewayProcess(GatewayPlan plan, Agenda& agenda, Party party, History& history, Fabric& fabric,
                 Random random);

  /// The machine of this name is there, over this cable, which outlives this.
  void plug(Controller& controller, Cable& cable);

  void start();
  /// kill -9, or the power of its host.
  void kill(bool power);
  /// SIGTERM: it ends once the answers at hand are written, or after two seconds.
  void stop();
  /// Its file is changed, and a SIGHUP sent if it runs.
  void reload(GatewayFile file);
  void cut_links(const std::string& machine, const std::string& reason);

  [[nodiscard]] GatewayNumber number() const { return plan_.number; }
  [[nodiscard]] const GatewayFile& file() const { return plan_.file; }
  Disk& disk() { return disk_; }

  /// What has come to it over the fabric. For who tries all orders.
  [[nodiscard]] std::string hearing() const { return end() ? fabric().place_of(*end()) : ""; }

  /// What an operator sees and can do.
  [[nodiscard]] const std::map<Key, fabric::ChannelStatus>& statuses() const { return statuses_; }
  void answer(const Key& key, const fabric::CallId& call);
  void retry(const Key& key, const fabric::CallId& call);
  /// Messages of its queues that are not answered, and calls that the journal holds open; nothing
  /// while it does not run.
  [[nodiscard]] std::size_t waiting_messages() const;
  [[nodiscard]] std::size_t open_calls() const;
  /// It serves the channel now.
  [[nodiscard]] bool serves(const Key& key) const { return served_.contains(key); }
  /// It has started with less than it had journalled: a program may wait for an answer that nobody
  /// remembers.
  [[nodiscard]] bool lost_memory() const { return lost_memory_; }

 private:
  // The fabric.
  void on_instance_ready(const fabric::InstanceIdentity& instance) override;
  void on_instance_changed(const fabric::InstanceIdentity& instance) override;
  void on_instance_gone(const fabric::InstanceId& instance) override;
  void on_load(const fabric::InstanceLoad& load) override;
  void on_reply(const fabric::Reply& reply) override;
  void on_stranger(const fabric::Reply& reply) override;
  // Other gateways.
  void on_machine(const fabric::MachineStatus& status) override;
  void on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway) override;
  void on_channel(const fabric::ChannelStatus& status) override;
  // What the machines need.
  [[nodiscard]] gateway::Moment now() const override;
  void after(std::chrono::nanoseconds delay, std::function<void()> act) override;
  std::unique_ptr<gateway::machines::Link> connect(
      const gateway::settings::MachineSettings& settings,
      gateway::machines::LinkEvents& events) override;
  void say(gateway::Level level, const std::string& text) override;
  // What happens on them.
  void on_link_up(const std::string& machine, const std::vector<std::uint16_t>& channels) override;
  void on_link_down(const std::string& machine, const std::string& reason) override;
  void on_link_dropped(const std::string& machine, const std::string& reason) override;
  void on_retired(const Key& key) override;
  void on_refused(const Key& key, const std::string& reason) override;
  void on_inherited(const fabric::ChannelStatus& status, const std::string& from) override;
  void on_machine_status(const fabric::MachineStatus& status) override;
  void on_machine_left(const fabric::MachineStatus& status) override;
  void on_contested() override;
  [[nodiscard]] std::vector<std::uint16_t> channels_of(const std::string& machine) const override;
  void on_read(const Key& key, const gateway::Snapshot& snapshot) override;
  void on_read_failed(const Key& key, const std::string& reason) override;
  void on_write(const Key& key, gateway::WriteOutcome outcome, const std::string& reason) override;
  void on_pushed(const Key& key, bool pushed) override;
  void on_change(const Key& key, gateway::Variable variable) override;
  // Message queues; gateway_queues.cpp.
  std::unique_ptr<gateway::queues::QueueLink> reach(
      const std::string& machine, const gateway::queues::QueueSettings& settings) override;
  void on_queue_open(const Key& key) override;
  void on_queue_down(const Key& key, const std::string& reason) override;
  void on_queue_retired(const Key& key) override;
  void on_queue_read(const Key& key, const gateway::Snapshot& snapshot) override;
  void on_queue_write(const Key& key) override;
  void on_queue_change(const Key& key) override;
  void record_of_queue(const std::vector<gateway::JournalEntry>& entries,
                       const gateway::Ticket& ticket) override;
  void say_of_queue(const Key& key, const gateway::queues::Queue::News& news) override;
  void tell_queue(const fabric::DataSample&) override {}
  void write_queue(const Key& key, const gateway::Write& action);
  // What is seen of a link.
  void on_looked(Time first) override { looked_from_ = first; }
  AdsWrite describe(const Key& key, gateway::Variable variable,
                    const gateway::Value& value) override {
    return witness_.describe(key, variable, value);
  }

  // gateway_actions.cpp
  void carry_out(const gateway::control::ChannelActions& actions);
  void carry_out(const Key& key, const gateway::Read& action);
  void carry_out(const Key& key, const gateway::Write& action);
  void carry_out(const Key& key, const gateway::Record& action);
  void append(const gateway::JournalEntry& entry, const gateway::Ticket& ticket);
  void on_recorded(const gateway::Ticket& ticket);
  void carry_out(const Key& key, const gateway::Publish& action);
  void carry_out(const Key& key, const gateway::Withdraw& action);
  void carry_out(const Key& key, const gateway::Tell& action);
  void carry_out(const Key& key, const gateway::Show& action);
  void carry_out(const Key& key, const gateway::Say& action);
  void carry_out(const Key& key, const gateway::WriteProblem& action);
  void carry_out(const Key& key, const gateway::Hide& action);
  void arm_timer();

  void tick();
  void beat();
  void read_file();
  void end_when_answered();
  void forget();
  void served_no_more(const std::string& machine);
  /// As gateway::live::Gateway does where an event begins.
  void begin_event();
  [[nodiscard]] gateway::Moment moment() const;

  GatewayPlan plan_;
  Random random_;
  Disk disk_;
  Witness witness_;
  Mistakes mistakes_;
  struct Machine {
    Controller* controller;
    Cable* cable;
  };
  std::map<std::string, Machine> plugged_;

  // Of this life of the process.
  std::optional<gateway::journal::Keeper> keeper_;
  std::optional<gateway::control::CallControl> control_;
  std::optional<gateway::machines::StallDetector> stall_;
  std::optional<gateway::machines::LinkGate> gate_;
  std::optional<gateway::queues::PlantQueues> queues_;
  std::unique_ptr<gateway::machines::Machines> machines_;
  std::map<std::string, std::weak_ptr<AdsLink>> links_;
  std::optional<gateway::SteadyTime> armed_;
  std::uint64_t armed_number_ = 0;
  bool ending_ = false;
  bool in_trouble_ = false;
  Time looked_from_{};
  /// What its last on_link_up named.
  std::set<Key> served_;

  bool lost_memory_ = false;
  /// The steady clock of its host.
  Time booted_{};
  std::map<Key, fabric::ChannelStatus> statuses_;
};

}  // namespace millrace::tests::simulation
