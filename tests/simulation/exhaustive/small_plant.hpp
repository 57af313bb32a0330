// One channel, one gateway, two instances of a service, and one thing that goes wrong, at any
// moment.
#pragma once

#include <array>
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
  /// Nothing comes through for a while, and nobody is told.
  link_silent,
  program_reset,
};

struct MishapName {
  Mishap mishap;
  std::string_view name;
};

inline constexpr std::array mishap_names{
    MishapName{Mishap::none, "nothing"},
    MishapName{Mishap::gateway_killed, "gateway-killed"},
    MishapName{Mishap::gateway_power_cut, "gateway-power-cut"},
    MishapName{Mishap::instance_killed, "instance-killed"},
    MishapName{Mishap::instance_drained, "instance-drained"},
    MishapName{Mishap::link_cut, "link-cut"},
    MishapName{Mishap::link_silent, "link-silent"},
    MishapName{Mishap::program_reset, "program-reset"},
};

struct SmallPlan {
  Mishap mishap = Mishap::none;
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  fabric::CompletionSignal completion_signal = fabric::CompletionSignal::response_state;
  cnc::simulator::ServiceRules rules{};
  /// Whether a controller does what it has received on a connection that is gone.
  bool leftovers_dropped = false;
  std::size_t calls = 1;
  WriteHabits writes{};
  Bug bug = Bug::none;
};

class SmallPlant {
 public:
  SmallPlant(Explorer& explorer, const SmallPlan& plan, History::Trace trace = {});

  /// Until the program has come to its end and no call is open, or the explorer ends it; violations
  /// then.
  std::vector<std::string> run();
  /// What can be seen of it: what a person would look at, not what tells states apart.
  [[nodiscard]] std::string sight() const;

 private:
  void describe();
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
