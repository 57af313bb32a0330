// Faults of gateways and services.
#include "tests/simulation/faults/fault_injector.hpp"

namespace millrace::tests::simulation {

void FaultInjector::kill_gateway() {
  some_gateway().kill(false);
}

void FaultInjector::cut_gateway_power() {
  some_gateway().kill(true);
}

void FaultInjector::stop_gateway() {
  some_gateway().stop();
}

void FaultInjector::freeze_gateway() {
  GatewayProcess& gateway = some_gateway();
  gateway.freeze();
  for_a_while([&gateway] { gateway.thaw(); });
}

void FaultInjector::kill_service() {
  some_service().kill();
}

void FaultInjector::drain_service() {
  some_service().drain();
}

void FaultInjector::freeze_service() {
  ServiceProcess& service = some_service();
  service.freeze();
  for_a_while([&service] { service.thaw(); });
}

void FaultInjector::fill_disk() {
  GatewayProcess& gateway = some_gateway();
  plant_.history().note("disk", "is full");
  gateway.disk().full = true;
  for_a_while([this, &gateway] {
    plant_.history().note("disk", "has room again");
    gateway.disk().full = false;
  });
}

void FaultInjector::reload_gateway() {
  GatewayProcess& gateway = some_gateway();
  GatewayFile file = plant_.first_file(gateway);
  std::erase_if(file.machines, [this](const auto&) { return random_.chance(20); });
  for (auto& machine : file.machines) {
    if (random_.chance(40)) {
      machine.channels = {1};
      if (random_.chance(30) && plant_.channels_of(machine.name) > 1) {
        machine.channels.push_back(2);
      }
    }
    if (random_.chance(30)) {
      machine.intervals.idle = std::chrono::milliseconds(10 + random_.below(80));
    }
    // A separate random source, so that the rest of a seed keeps its meaning.
    if (Random chance(~random_.state()); chance.chance(30)) {
      std::erase_if(machine.queues, [&](auto&) { return chance.chance(60); });
    } else if (chance.chance(20)) {
      for (auto& queue : machine.queues) {
        queue.backlog = 1 + chance.below(20);
        queue.uuid = chance.pick(plant_.uuids());
      }
    }
    if (random_.chance(20)) {
      // A different address of the same controller.
      ++machine.tcp_port;
    }
  }
  if (random_.chance(50)) {
    file.policies = plant_.draw_policies(random_);
  }
  gateway.reload(file);
  for_a_while([this, &gateway] { gateway.reload(plant_.first_file(gateway)); });
}

void FaultInjector::step_clock() {
  const Time by = random_.between(-7200s, 7200s);
  if (random_.chance(60)) {
    some_gateway().step_clock(by);
  } else {
    some_service().step_clock(by);
  }
}

}  // namespace millrace::tests::simulation
