// The parts of one simulation, drawn from its seed: controllers with their programs, gateways and
// their machines, services.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/simulation/gateway/gateway_process.hpp"
#include "tests/simulation/service/service_process.hpp"
#include "tests/simulation/service/stranger.hpp"

namespace millrace::tests::simulation {

/// What a simulation leaves out; the rest of its seed keeps its meaning.
struct Limits {
  /// Channels and queues whose programs send nothing: "m0/3", "m0.q1/2".
  std::set<std::string> quiet{};
  /// Kinds of faults that do not happen (faults/fault_injector.hpp).
  std::set<std::string> without{};
  /// Faults end this long after they have begun.
  std::optional<Time> faults_for{};
  bool operator==(const Limits&) const = default;
};

class Plant {
 public:
  Plant(Agenda& agenda, History& history, Random random, Bug bug, Limits limits = {});

  [[nodiscard]] Agenda& agenda() { return agenda_; }
  [[nodiscard]] History& history() { return history_; }
  [[nodiscard]] Fabric& fabric() { return fabric_; }
  std::vector<std::unique_ptr<Controller>>& controllers() { return controllers_; }
  std::vector<std::unique_ptr<GatewayProcess>>& gateways() { return gateways_; }
  std::vector<std::unique_ptr<ServiceProcess>>& services() { return services_; }
  /// Null if there is none.
  Stranger* stranger() { return stranger_.get(); }
  std::vector<std::unique_ptr<LinkConditions>>& link_conditions() { return link_conditions_; }
  [[nodiscard]] LinkConditions& conditions_of(const Controller& controller);
  /// The gateways with this machine in their first configuration.
  std::vector<GatewayProcess*> gateways_of(const Controller& controller);
  [[nodiscard]] std::size_t channels_of(const std::string& machine) const;
  void cut_links(const Controller& controller, const std::string& reason);
  /// The first configuration of a gateway.
  [[nodiscard]] const GatewayFile& first_file(const GatewayProcess& gateway) const {
    return first_files_.at(gateway.number());
  }
  /// The UUIDs of the services.
  [[nodiscard]] const std::vector<std::string>& uuids() const { return uuids_; }
  [[nodiscard]] const Limits& limits() const { return limits_; }
  /// The names of all channels and queues.
  [[nodiscard]] std::vector<std::string> programs() const;
  /// Policies that no configuration had before.
  gateway::Policies draw_policies(Random& random);

 private:
  void build_services();
  void build_controllers();
  void build_gateways();
  [[nodiscard]] NotificationBehaviour draw_notifications() const;
  [[nodiscard]] WriteBehaviour draw_writes() const;
  void let_kernel_clear(cnc::simulator::ServiceRules& rules) const;
  [[nodiscard]] fabric::CompletionSignal draw_completion_signal(std::size_t service) const;
  void let_wait_for_text(ProgramBehaviour& behaviour) const;
  void exaggerate(ProgramBehaviour& behaviour) const;
  gateway::settings::MachineSettings settings_of(const Controller& controller);
  void build_queues();

  Agenda& agenda_;
  History& history_;
  Random random_;
  Bug bug_;
  Limits limits_;
  Fabric fabric_;
  Party parties_ = 0;
  unsigned policies_drawn_ = 0;
  gateway::Policies policies_;
  std::vector<std::string> uuids_;
  /// UUIDs of services that know that their programs wait for RESPONSE alone.
  std::vector<std::string> text_uuids_;
  std::vector<std::unique_ptr<LinkConditions>> link_conditions_;
  std::vector<std::unique_ptr<Controller>> controllers_;
  std::vector<std::unique_ptr<GatewayProcess>> gateways_;
  std::vector<GatewayFile> first_files_;
  std::vector<std::unique_ptr<ServiceProcess>> services_;
  std::unique_ptr<Stranger> stranger_;
};

}  // namespace millrace::tests::simulation
