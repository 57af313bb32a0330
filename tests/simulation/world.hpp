// A whole plant in one thread and virtual time: controllers with their programs, gateways,
// services, and what lies between them. A seed says what there is and what befalls it.
//
//   World world(17, {});
//   const Outcome outcome = world.run();
//   for (const std::string& violation : outcome.violations) …
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/simulation/gateway/gateway_process.hpp"
#include "tests/simulation/service/service_process.hpp"

namespace millrace::tests::simulation {

struct Options {
  Bug bug = Bug::none;
  History::Trace trace;
};

struct Outcome {
  std::vector<std::string> violations;
  /// Virtual.
  Time took{};
  std::size_t answered = 0;
};

class Storm;

class World {
 public:
  World(std::uint64_t seed, Options options);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  Outcome run();

  // For who stirs it up.
  Agenda& agenda() { return agenda_; }
  History& history() { return history_; }
  Fabric& fabric() { return fabric_; }
  std::vector<std::unique_ptr<Controller>>& controllers() { return controllers_; }
  std::vector<std::unique_ptr<GatewayProcess>>& gateways() { return gateways_; }
  std::vector<std::unique_ptr<ServiceProcess>>& services() { return services_; }
  std::vector<std::unique_ptr<Cable>>& cables() { return cables_; }
  /// The gateway that serves a controller.
  GatewayProcess& gateway_of(const Controller& controller);
  Cable& cable_of(const Controller& controller);

 private:
  void build();
  void build_services();
  void build_controllers();
  gateway::CoreOptions core_options();
  void operate();
  void rescue();
  void supervise();
  [[nodiscard]] bool done() const;
  void judge_the_end();

  std::uint64_t seed_;
  Options options_;
  Random random_;
  Agenda agenda_;
  History history_;
  Fabric fabric_;
  Party parties_ = 0;
  std::vector<std::string> uuids_;
  std::vector<std::unique_ptr<Cable>> cables_;
  std::vector<std::unique_ptr<Controller>> controllers_;
  std::vector<std::unique_ptr<GatewayProcess>> gateways_;
  std::vector<std::size_t> served_by_;
  std::vector<std::unique_ptr<ServiceProcess>> services_;
  std::unique_ptr<Storm> storm_;
  bool calm_ = false;
  gateway::Policies policies_;
};

}  // namespace millrace::tests::simulation
