// The gateway without its sockets: call control, machines and message queues, and how they are
// wired to each other and to the ports. Decides only.
//
//   Core core(fabric, host, own, lease, machines, policies, ledger);
//   core.start();                                     → host.connect(…)
//   core.on_link_up("cnc", {1, 2});                   → the link's read(…)
//   core.on_read({"cnc", 1}, snapshot);
//
// Each function that is no `const` is an input: an event with the time that Host::now() has where
// it begins. First it notices that this gateway stood still, if it did: others may have taken its
// machines over meanwhile, so links may go before the event itself is looked at. Last it does what
// the event has left to do, and asks to be woken.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gateway/control/call_control.hpp"
#include "gateway/core/machines.hpp"
#include "gateway/core/message_queues.hpp"
#include "gateway/core/ports.hpp"
#include "gateway/machines/stall_detector.hpp"

namespace millrace::gateway::core {

struct CoreOptions {
  GatewayIdentity own{};
  /// How long others wait for a gateway that says nothing.
  std::chrono::nanoseconds lease{};
  std::vector<settings::MachineSettings> machines{};
  Policies policies{};
};

class Core : public machines::LinkEvents, protected MachinesListener, private Outputs {
 public:
  /// All must outlive this. `ledger` is what the journal adds up to.
  Core(Fabric& fabric, Host& host, CoreOptions options, const journal::Ledger& ledger);

  void start();
  /// The configuration has changed.
  void change(std::vector<settings::MachineSettings> machines, Policies policies);
  /// No call is accepted any more; then Host::may_end().
  void stop();
  /// The last input: takes back what is answered, and says which calls were never given out.
  void end();

  void on_time();
  /// It lives: others are to be told now, and again at the time that is returned.
  SteadyTime beat();
  /// About once a second: tells how busy links and queues are.
  void tell_load();
  /// Nothing else than that an event begins: notices that this gateway stood still.
  void on_other_event();

  // What the links say.
  void on_link_up(const std::string& machine, const machines::Channels& channels) override;
  void on_link_down(const std::string& machine, const std::string& reason) override;
  void on_read(const fabric::ChannelKey& key, const Snapshot& snapshot) override;
  void on_read_failed(const fabric::ChannelKey& key, const std::string& reason) override;
  void on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                const std::string& reason) override;
  void on_watched(const std::string& machine,
                  const std::vector<machines::WatchOutcome>& outcomes) override;
  void on_told(const fabric::ChannelKey& key, Variable variable,
               std::optional<std::uint32_t> value) override;
  void on_answer(const std::string& machine, const machines::Answer& answer) override;
  void on_queue_answer(const fabric::ChannelKey& queue, queues::StepAnswer answer) override;
  void on_queue_event(const fabric::ChannelKey& queue) override;

  // What the journal says.
  void on_recorded(const Ticket& ticket);
  /// It cannot be written, and why; empty = it can again.
  void on_journal_trouble(const std::string& trouble);

  // What happens on the fabric.
  void on_instance_ready(const fabric::InstanceIdentity& instance);
  void on_instance_gone(const fabric::InstanceId& instance);
  void on_load(const fabric::InstanceLoad& load);
  void on_reply(const fabric::Reply& reply);
  void set_interest(const Interest& interest);
  /// What other gateways say.
  void on_machine(const fabric::MachineStatus& status);
  void on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway);
  void on_channel(const fabric::ChannelStatus& status);
  /// Left to other gateways if the channel is not ours.
  void on_variable_request(const fabric::VariableRequest& request);

  // What an operator wants.
  control::Verdict on_answer(const fabric::ChannelKey& key, const fabric::CallId& call,
                             const control::OperatorAnswer& answer);
  control::Verdict on_retry(const fabric::ChannelKey& key, const fabric::CallId& call,
                            const std::string& by);

  [[nodiscard]] bool serves(const fabric::ChannelKey& key) const { return control_.serves(key); }
  [[nodiscard]] control::CallCounts counts() const { return control_.counts(); }

 protected:
  // The simulation sees through these what becomes of machines, and what the gateway shows its own
  // calls of a message queue.
  void on_serve(const std::string& machine, const machines::Channels& channels) override;
  void on_lost(const std::string& machine, const std::string& reason) override;
  void on_link_dropped(const std::string& machine, const std::string& reason) override;
  void on_retired(const fabric::ChannelKey& key) override;
  void on_refused(const fabric::ChannelKey& key, const std::string& reason) override;
  virtual void on_queue_read(const fabric::ChannelKey& key, const Snapshot& snapshot);
  virtual void write_queue(const fabric::ChannelKey& key, const Write& write);
  [[nodiscard]] Snapshot look_at_queue(const fabric::ChannelKey& key) const {
    return queues_.look(key, ReadSet::all);
  }

 private:
  void enter();
  void finish();
  /// Tells the call control what its channels of message queues have to say; false if nothing.
  bool tell_of_queues();
  [[nodiscard]] std::optional<SteadyTime> next_time() const;

  // What becomes of machines.
  void on_inherited(const fabric::ChannelStatus& status, const std::string& from) override;
  void on_pushed(const fabric::ChannelKey& key, bool pushed) override;
  void on_change(const fabric::ChannelKey& key, Variable variable) override;
  [[nodiscard]] machines::Channels channels_of(const std::string& machine) const override;

  // What channels do; core_outputs.cpp.
  void read(const fabric::ChannelKey& key, ReadSet look) override;
  void write(const fabric::ChannelKey& key, const Write& write) override;
  void record(const JournalEntry& entry, const Ticket& ticket) override;
  void publish(const fabric::Request& request) override;
  void publish(const fabric::Event& event) override;
  void publish(const fabric::ChannelStatus& status) override;
  void dispose(const fabric::RequestKey& request) override;
  void dispose(const fabric::ChannelKey& key) override;
  void say(const fabric::ChannelKey& key, Level level, const std::string& text) override;
  void tell_write_problem(const fabric::ChannelKey& key, const std::string& text) override;

  Fabric& fabric_;
  Host& host_;
  CoreOptions options_;
  const journal::Ledger& ledger_;
  Moment now_;
  /// An input is at work.
  bool inside_ = false;
  machines::StallDetector stall_;
  control::CallControl control_;
  MessageQueues queues_;
  Machines machines_;
  /// What was asked of the host last.
  std::optional<SteadyTime> wakes_at_;
  /// It is to end, at this time at the latest.
  std::optional<SteadyTime> ends_at_;
  bool may_end_ = false;
};

}  // namespace millrace::gateway::core
