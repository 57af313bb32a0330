// Faults of gateways and services.
#include "tests/simulation/faults/storm.hpp"

namespace millrace::tests::simulation {

void Storm::kill_gateway() {
  random_.pick(world_.gateways())->kill(false);
}

void Storm::cut_gateway_power() {
  random_.pick(world_.gateways())->kill(true);
}

void Storm::stop_gateway() {
  random_.pick(world_.gateways())->stop();
}

void Storm::freeze_gateway() {
  GatewayProcess& gateway = *random_.pick(world_.gateways());
  gateway.freeze();
  for_a_while([&gateway] { gateway.thaw(); });
}

void Storm::kill_service() {
  random_.pick(world_.services())->kill();
}

void Storm::drain_service() {
  random_.pick(world_.services())->drain();
}

void Storm::freeze_service() {
  ServiceProcess& service = *random_.pick(world_.services());
  service.freeze();
  for_a_while([&service] { service.thaw(); });
}

void Storm::fill_disk() {
  GatewayProcess& gateway = *random_.pick(world_.gateways());
  world_.history().note("disk", "is full");
  gateway.disk().full = true;
  for_a_while([this, &gateway] {
    world_.history().note("disk", "has room again");
    gateway.disk().full = false;
  });
}

void Storm::step_clock() {
  const Time by = random_.between(-7200s, 7200s);
  if (random_.chance(60)) {
    random_.pick(world_.gateways())->step_clock(by);
  } else {
    random_.pick(world_.services())->step_clock(by);
  }
}

}  // namespace millrace::tests::simulation
