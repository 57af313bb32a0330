// One channel, one gateway, two instances of a service, and one thing that goes wrong, at any
// moment.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/simulation/exhaustive/explorer.hpp"
#include "tests/simulation/gateway/gateway_process.hpp"
#include "tests/simulation/service/service_process.hpp"

namespace millrace::tests::simulation {

enum class Mishap : std::uint8_t {
  none,
  gateway_killed,
  gateway_power_cut,
  instance_killed,
  instance_drained,
  link_cut,
  program_reset,
};

struct SmallPlan {
  Mishap mishap = Mishap::none;
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  cnc::simulator::ServiceRules rules{};
  /// Whether a controller does what it has received on a connection that is gone.
  bool leftovers_dropped = false;
  std::size_t calls = 1;
  Bug bug = Bug::none;
};

class SmallPlant {
 public:
  SmallPlant(Explorer& explorer, const SmallPlan& plan, History::Trace trace = {});

  /// Until the program has come to its end and no call is open, or the explorer ends it; violations
  /// then.
  std::vector<std::string> run();

 private:
  void strike();
  [[nodiscard]] std::uint64_t struck() const;
  void restart(const std::function<void()>& start);
  [[nodiscard]] bool done() const;

  SmallPlan plan_;
  Explorer& explorer_;
  Agenda agenda_;
  History history_;
  Fabric fabric_;
  Cable cable_;
  Controller controller_;
  GatewayProcess gateway_;
  ServiceProcess first_;
  /// Gets the call, so this is the one that is struck.
  ServiceProcess second_;
  bool struck_ = false;
};

}  // namespace millrace::tests::simulation
