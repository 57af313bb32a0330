// An instance of a service: the real call desk of the SDK, with the simulation for its runner and
// its handlers. Each start is an instance of its own.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "services/sdk/call_desk.hpp"
#include "tests/simulation/fabric/member.hpp"
#include "tests/simulation/gateway/bug.hpp"

namespace millrace::tests::simulation {

/// In a hundred calls.
struct HandlerHabits {
  unsigned slow = 10;
  unsigned fails = 5;
  /// Answers what cannot be written.
  unsigned refused = 0;
  unsigned interim = 10;
  /// Never comes to an end.
  unsigned stuck = 0;
};

struct ServicePlan {
  std::string name;
  std::string uuid;
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  std::uint32_t concurrency = 1;
  std::vector<fabric::ChannelScope> channels;
  HandlerHabits habits;
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
  /// From now on handlers are well.
  void calm_down();

  [[nodiscard]] const ServicePlan& plan() const { return plan_; }
  [[nodiscard]] bool stuck() const { return stuck_; }
  [[nodiscard]] bool idle() const { return !desk_ || desk_->idle(); }
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
  void handle(const fabric::Request& request);
  void finish(const fabric::Request& request);
  void open_desk();
  void told(const std::string& what);
  void close_when_idle();
  void leave_soon();

  ServicePlan plan_;
  Random random_;
  bool calm_ = false;

  // Of this life of the process.
  fabric::InstanceIdentity identity_;
  std::optional<services::sdk::CallDesk> desk_;
  /// Who has asked, for who mistakes one for the other.
  std::set<fabric::RequestKey> asked_;
  /// All that the desk was told, which is all that it knows.
  Meaning desk_knows_ = 0;
  bool closing_ = false;
  bool closed_ = false;
  bool stuck_ = false;
};

}  // namespace millrace::tests::simulation
