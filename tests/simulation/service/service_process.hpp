// An instance of a service: the real call scheduler of the SDK, with the simulation for its runner
// and its handlers. Each start is an instance of its own.
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

/// In a hundred calls.
struct HandlerHabits {
  unsigned slow = 10;
  unsigned fails = 5;
  /// Answers what cannot be written: an interim answer, or the last one.
  unsigned refused = 0;
  unsigned interim = 10;
  /// Never comes to an end.
  unsigned stuck = 0;
  /// Ends early when it is told that nobody waits.
  unsigned obeys = 0;
};

struct ServicePlan {
  std::string name;
  std::string uuid;
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  /// Of those whose programs wait for RESPONSE alone half of the answers have state 0.
  fabric::CompletionSignal completion_signal = fabric::CompletionSignal::response_state;
  std::uint32_t concurrency = 1;
  std::vector<fabric::ChannelScope> channels;
  HandlerHabits habits;
  /// Not written with the SDK: what cannot be written goes out as it is.
  bool foreign = false;
  /// Says what it does, several times a second.
  bool heartbeats = false;
  /// One of those that leaves the attempt out.
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
  /// Asks for no new call and leaves when the last one is answered.
  void drain();
  /// Says something more of this call if it is the one that it has answered last: after that a
  /// gateway that has the answer must not listen.
  void speak_again(const fabric::CallId& call);
  /// From now on handlers are well.
  void calm_down();

  [[nodiscard]] const ServicePlan& plan() const { return plan_; }
  [[nodiscard]] const fabric::InstanceId& instance() const { return identity_.id; }
  [[nodiscard]] bool stuck() const { return stuck_; }
  [[nodiscard]] bool idle() const { return !scheduler_ || scheduler_->idle(); }
  /// All that its future follows from, but for what is on its way to it. For who tries all orders.
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
    /// It was told that nobody waits.
    bool cancelled = false;
    bool ended = false;
  };
  using RunPointer = std::shared_ptr<Run>;
  void say(fabric::Reply reply);
  // service_handlers.cpp
  void handle(const RunPointer& run);
  void say_meanwhile(const RunPointer& run, const services::sdk::Response& response);
  void finish(const RunPointer& run);
  [[nodiscard]] services::sdk::Result result_of(const Run& run);
  [[nodiscard]] bool waits_for_response() const {
    return plan_.completion_signal == fabric::CompletionSignal::response;
  }
  /// What no channel can take.
  [[nodiscard]] services::sdk::Response garbage(const fabric::Request& request);
  // service_process.cpp
  void open_scheduler();
  void heartbeat();
  void told(const std::string& what);
  void close_when_idle();
  void leave_soon();

  ServicePlan plan_;
  Random random_;
  bool calm_ = false;

  // Of this life of the process.
  fabric::InstanceIdentity identity_;
  std::optional<services::sdk::CallScheduler> scheduler_;
  /// Who has asked, for who mistakes one for the other.
  std::set<fabric::RequestKey> asked_;
  /// The newest of each call.
  std::map<fabric::CallId, RunPointer> runs_;
  /// Final answers that the SDK would not let out.
  std::map<fabric::CallId, services::sdk::Response> garbled_;
  fabric::Reply last_answer_;
  /// All that the scheduler was told, which is all that it knows.
  Meaning scheduler_knows_ = 0;
  bool closing_ = false;
  bool closed_ = false;
  bool stuck_ = false;
};

}  // namespace millrace::tests::simulation
