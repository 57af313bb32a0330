// Faults of the network between gateways and services.
#include "tests/simulation/faults/storm.hpp"

namespace millrace::tests::simulation {

void Storm::cut_path() {
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
  befalls_all();
  plant_.history().note("network", "a path is cut");
  set(false);
  for_a_while([this, set] {
    plant_.history().note("network", "a path is open again");
    set(true);
  });
}

void Storm::cut_off() {
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
  befalls_all();
  plant_.history().note("network", "an end is cut off");
  set(false);
  for_a_while([this, set] {
    plant_.history().note("network", "an end is back");
    set(true);
  });
}

void Storm::part_gateways() {
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
  befalls([&](const GatewayProcess& gateway, const auto&) {
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

void Storm::lose_samples() {
  befalls_all();
  FabricWeather& weather = plant_.fabric().weather;
  weather.lost = static_cast<unsigned>(1 + random_.below(60));
  weather.delay_most = random_.mostly(1ms, 20ms, 300ms, 30);
  for_a_while([&weather] {
    weather.lost = 0;
    weather.delay_most = FabricWeather{}.delay_most;
  });
}

}  // namespace millrace::tests::simulation
