// An instance of a service: the real call scheduler of the SDK, with simulated runner and handlers.
// Each start is a new instance.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "services/sdk/call_scheduler.hpp"
#include "tests/simulation/fabric/member.hpp"
#include "tests/simulation/gateway/bug.hpp"

namespace millrace::tests::simulation {

/// Percentages of calls.
struct HandlerBehaviour {
  unsigned slow = 10;
  unsigned fails = 5;
  /// Returns an invalid answer, as an interim or as the final one.
  unsigned refused = 0;
  unsigned interim = 10;
  /// Never ends.
  unsigned stuck = 0;
  /// Ends early when it is cancelled.
  unsigned obeys = 0;
};

struct ServicePlan {
  std::string name;
  std::string uuid;
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  /// Half of the answers have state 0 where programs wait for RESPONSE alone.
  fabric::CompletionSignal completion_signal = fabric::CompletionSignal::response_state;
  std::uint32_t concurrency = 1;
  std::vector<fabric::ChannelScope> channels;
  HandlerBehaviour behaviour;
  /// Not written with the SDK: an invalid answer is published unchanged.
  bool foreign = false;
  /// Publishes its calls several times a second.
  bool heartbeats = false;
  /// Its heartbeats leave out the attempt.
  bool counts_no_attempts = false;
  Bug bug = Bug::none;
};

class ServiceProcess final : public Member, private InstanceListener {
 public:
  ServiceProcess(ServicePlan plan, Agenda& agenda, Party party, History& history, Fabric& fabric,
                 Random random);

  void start();
  /// kill -9
  void kill();
  /// Takes no new call and leaves when the last one is answered.
  void drain();
  /// Publishes a further reply to this call if it is the last that it has answered: a gateway that
  /// has the answer must ignore it.
  void speak_again(const fabric::CallId& call);
  /// From now on handlers work normally.
  void calm_down();

  [[nodiscard]] const ServicePlan& plan() const { return plan_; }
  [[nodiscard]] const fabric::InstanceId& instance() const { return identity_.id; }
  [[nodiscard]] bool stuck() const { return stuck_; }
  [[nodiscard]] bool idle() const { return !scheduler_ || scheduler_->idle(); }
  /// Everything that determines its future, except what is on its way to it; for a walk through all
  /// orders.
  [[nodiscard]] std::string place() const;

 private:
  [[nodiscard]] fabric::Moment moment() const;
  void on_request(const fabric::Request& request) override;
  void on_withdrawn(const fabric::RequestKey& key) override;
  void on_orphaned(const fabric::RequestKey& key) override;
  void perform(const services::sdk::Actions& actions);
  void perform(const services::sdk::Start& start);
  void perform(const services::sdk::Send& send);
  void perform(const services::sdk::Cancel& cancel);
  void perform(const services::sdk::Drop&) {}

  /// A handler that runs.
  struct Run {
    fabric::Request request;
    bool obeys = false;
    /// It was cancelled.
    bool cancelled = false;
    bool ended = false;
  };
  using RunPointer = std::shared_ptr<Run>;
  void say(fabric::Reply reply);
  void handle(const RunPointer& run);
  void say_meanwhile(const RunPointer& run, const services::sdk::Response& response);
  void finish(const RunPointer& run);
  [[nodiscard]] services::sdk::Result result_of(const Run& run);
  [[nodiscard]] bool waits_for_response() const {
    return plan_.completion_signal == fabric::CompletionSignal::response;
  }
  /// An answer that no channel can take.
  [[nodiscard]] services::sdk::Response garbage(const fabric::Request& request);
  // service_process.cpp
  void open_scheduler();
  void heartbeat();
  void note_input(const std::string& what);
  void close_when_idle();
  void leave_soon();

  ServicePlan plan_;
  Random random_;
  bool calm_ = false;

  // Of this run of the process.
  fabric::InstanceIdentity identity_;
  std::optional<services::sdk::CallScheduler> scheduler_;
  /// All requests so far, for the mistake that confuses them.
  std::set<fabric::RequestKey> asked_;
  /// The newest run of each call.
  std::map<fabric::CallId, RunPointer> runs_;
  /// Final answers that the SDK would refuse.
  std::map<fabric::CallId, services::sdk::Response> garbled_;
  fabric::Reply last_answer_;
  /// All inputs of the scheduler, which determine its state.
  Meaning scheduler_knows_ = 0;
  bool closing_ = false;
  bool closed_ = false;
  bool stuck_ = false;
};

}  // namespace millrace::tests::simulation
