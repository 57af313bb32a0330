// Faults of the network between gateways and services.
#include "tests/simulation/faults/fault_injector.hpp"

namespace millrace::tests::simulation {

void FaultInjector::cut_path() {
  // In one direction, or in both.
  const auto ends = plant_.fabric().ends();
  if (ends.size() < 2) {
    return;
  }
  const EndNumber from = ends[random_.below(ends.size())];
  const EndNumber to = ends[random_.below(ends.size())];
  const bool both = random_.chance(50);
  const auto set = [this, from, to, both](bool open) {
    plant_.fabric().set_path(from, to, open);
    if (both) {
      plant_.fabric().set_path(to, from, open);
    }
  };
  count_all_hits();
  plant_.history().note("network", "a path is cut");
  set(false);
  for_a_while([this, set] {
    plant_.history().note("network", "a path is open again");
    set(true);
  });
}

void FaultInjector::cut_off() {
  // One end is cut off from all others.
  const auto ends = plant_.fabric().ends();
  if (ends.empty()) {
    return;
  }
  const EndNumber one = ends[random_.below(ends.size())];
  const auto set = [this, one, ends](bool open) {
    for (const EndNumber other : ends) {
      plant_.fabric().set_path(one, other, open);
      plant_.fabric().set_path(other, one, open);
    }
  };
  count_all_hits();
  plant_.history().note("network", "an end is cut off");
  set(false);
  for_a_while([this, set] {
    plant_.history().note("network", "an end is back");
    set(true);
  });
}

void FaultInjector::part_gateways() {
  // Each continues with its controllers and services and regards the other as gone.
  const auto& gateways = plant_.gateways();
  if (gateways.size() < 2) {
    return;
  }
  const auto one = random_.pick(gateways)->end();
  const auto other = random_.pick(gateways)->end();
  if (!one || !other || one == other) {
    return;
  }
  count_hits([&](const GatewayProcess& gateway, const auto&) {
    return gateway.end() == one || gateway.end() == other;
  });
  const auto set = [this, from = *one, to = *other](bool open) {
    plant_.fabric().set_path(from, to, open);
    plant_.fabric().set_path(to, from, open);
  };
  plant_.history().note("network", "two gateways do not hear each other");
  set(false);
  for_a_while([this, set] {
    plant_.history().note("network", "two gateways hear each other again");
    set(true);
  });
}

void FaultInjector::lose_samples() {
  count_all_hits();
  FabricConditions& conditions = plant_.fabric().conditions;
  conditions.lost = static_cast<unsigned>(1 + random_.below(60));
  conditions.delay_most = random_.mostly(1ms, 20ms, 300ms, 30);
  for_a_while([&conditions] {
    conditions.lost = 0;
    conditions.delay_most = FabricConditions{}.delay_most;
  });
}

}  // namespace millrace::tests::simulation
