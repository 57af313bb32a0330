// A gateway: the real core and the real journal keeper, with the simulation as hands and feet, as
// gateway/gateway.cpp is with sockets.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/core.hpp"
#include "gateway/journal/keeper.hpp"
#include "tests/simulation/fabric/fabric.hpp"
#include "tests/simulation/gateway/ads_link.hpp"
#include "tests/simulation/gateway/bug.hpp"
#include "tests/simulation/gateway/disk.hpp"

namespace millrace::tests::simulation {

struct GatewayPlan {
  GatewayNumber number = 0;
  gateway::CoreOptions core;
  gateway::journal::FileOptions journal;
  /// It has no journal folder: a restart forgets all.
  bool in_memory = false;
  Bug bug = Bug::none;
};

class GatewayProcess final : public GatewayEars, public LinkListener {
 public:
  GatewayProcess(GatewayPlan plan, Agenda& agenda, Party party, History& history, Fabric& fabric,
                 Random random);

  /// `cable` outlives this.
  void serve(Controller& controller, Cable& cable);

  void start();
  /// kill -9, or the power of its host.
  void kill(bool power);
  /// SIGTERM: it ends once the answers at hand are written, or after two seconds.
  void stop();
  void freeze();
  void thaw();
  void step_clock(Time by) { clock_error_ += by; }
  void cut_links(const std::string& machine, const std::string& reason);

  [[nodiscard]] bool running() const { return process_.running(); }
  [[nodiscard]] bool frozen() const { return process_.frozen(); }
  [[nodiscard]] std::optional<EndNumber> end() const { return end_; }
  Disk& disk() { return disk_; }

  /// What an operator sees and can do.
  [[nodiscard]] const std::map<Key, fabric::ChannelStatus>& statuses() const { return statuses_; }
  void answer(const Key& key, const fabric::CallId& call);
  void retry(const Key& key, const fabric::CallId& call);
  /// Calls that the journal holds open; nothing while it does not run.
  [[nodiscard]] std::size_t open_calls() const;
  /// It has started with less than it had journalled: a program may wait for an answer that nobody
  /// remembers.
  [[nodiscard]] bool lost_memory() const { return lost_memory_; }

 private:
  /// The call of a channel, as the actions told of it.
  struct Current {
    fabric::CallId call;
    gateway::PendingRequest request;
    std::optional<gateway::journal::Answer> answer;
  };

  // The fabric.
  void on_instance_ready(const fabric::InstanceIdentity& instance) override;
  void on_instance_changed(const fabric::InstanceIdentity& instance) override;
  void on_instance_gone(const fabric::InstanceId& instance) override;
  void on_reply(const fabric::Reply& reply) override;
  // The machines.
  void on_link_up(const std::string& machine, const std::vector<std::uint16_t>& channels) override;
  void on_link_down(const std::string& machine, const std::string& reason) override;
  void on_read(const Key& key, const gateway::Picture& picture, Time first) override;
  void on_read_failed(const Key& key, const std::string& reason) override;
  void on_write(const Key& key, gateway::WriteOutcome outcome, const std::string& reason) override;

  void carry_out(const gateway::ChannelActions& actions);
  void carry_out(const Key& key, const gateway::Read& action);
  void carry_out(const Key& key, const gateway::Write& action);
  void carry_out(const Key& key, const gateway::WakeAt& action);
  void carry_out(const Key& key, const gateway::Record& action);
  void carry_out(const Key& key, const gateway::Publish& action);
  void carry_out(const Key& key, const gateway::Withdraw& action);
  void carry_out(const Key& key, const gateway::Tell& action);
  void carry_out(const Key& key, const gateway::Show& action);
  void carry_out(const Key& key, const gateway::Say& action);
  void carry_out(const Key& key, const gateway::Hide& action);
  // The core keeps these to itself.
  void carry_out(const Key&, const gateway::Offer&) {}
  void carry_out(const Key&, const gateway::LeaveBe&) {}
  void carry_out(const Key&, const gateway::Resume&) {}
  void carry_out(const Key&, const gateway::Freed&) {}

  void observe(const Key& key, const gateway::journal::Entry& entry);
  void given_out(const gateway::journal::Dispatched& entry);
  void learn(const fabric::InstanceIdentity& instance);
  void arm_timer();
  void tick();
  void forget();
  [[nodiscard]] gateway::Moment moment() const;
  AdsLink& link(const std::string& machine) { return *links_.at(machine); }

  GatewayPlan plan_;
  Agenda& agenda_;
  History& history_;
  Fabric& fabric_;
  Random random_;
  Process process_;
  Disk disk_;
  struct Machine {
    Controller* controller;
    Cable* cable;
  };
  std::vector<Machine> machines_;

  // Of this life of the process.
  std::optional<gateway::journal::Keeper> keeper_;
  std::optional<gateway::Core> core_;
  std::optional<EndNumber> end_;
  std::map<std::string, std::shared_ptr<AdsLink>> links_;
  std::map<Key, gateway::SteadyTime> wakes_;
  std::map<Key, std::uint64_t> wake_numbers_;
  std::optional<gateway::SteadyTime> armed_;
  std::uint64_t armed_number_ = 0;
  bool ending_ = false;
  bool in_trouble_ = false;
  bool lost_memory_ = false;
  /// The steady clock of the host and the error of its wall clock.
  Time booted_{};
  Time clock_error_{};
  Time frozen_at_{};

  // What is seen of it.
  std::map<Key, fabric::ChannelStatus> statuses_;
  std::map<Key, Current> current_;
  std::map<fabric::InstanceId, fabric::InstanceIdentity> ready_;
  std::map<fabric::CallId, fabric::InstanceId> given_;
  // What the deliberate mistakes need.
  std::map<Key, gateway::Picture> last_looks_;
  std::map<Key, gateway::Picture> last_states_;
  std::map<Key, gateway::Picture> texts_read_;
  std::map<Key, gateway::Value> held_texts_;
  std::map<Key, gateway::Write> last_writes_;
};

}  // namespace millrace::tests::simulation
