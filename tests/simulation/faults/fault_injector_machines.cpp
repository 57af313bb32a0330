// Faults of controllers and of the links to them.
#include "tests/simulation/faults/fault_injector.hpp"

namespace millrace::tests::simulation {

void FaultInjector::cut_link() {
  Controller& controller = some_controller();
  plant_.cut_links(controller, "connection reset");
}

void FaultInjector::silence_link() {
  Controller& controller = some_controller();
  LinkConditions& conditions = plant_.conditions_of(controller);
  plant_.history().note(controller.name(), "nothing comes through");
  conditions.silent = true;
  for_a_while([this, &conditions, &controller] {
    plant_.history().note(controller.name(), "all comes through again");
    conditions.silent = false;
  });
}

void FaultInjector::slow_link() {
  Controller& controller = some_controller();
  LinkConditions& conditions = plant_.conditions_of(controller);
  conditions.delay_most = random_.mostly(5ms, 200ms, 2500ms, 30);
  conditions.delay_least = random_.between(Time{}, conditions.delay_most);
  conditions.late_until = std::max(
      conditions.late_until, plant_.agenda().now() + longest_fault + 2 * conditions.delay_most);
  plant_.history().note(controller.name(), "is slow");
  for_a_while([&conditions] {
    conditions.delay_least = LinkConditions{}.delay_least;
    conditions.delay_most = LinkConditions{}.delay_most;
  });
}

void FaultInjector::refuse_requests() {
  LinkConditions& conditions = plant_.conditions_of(some_controller());
  conditions.refused = static_cast<unsigned>(1 + random_.below(50));
  for_a_while([&conditions] { conditions.refused = 0; });
}

void FaultInjector::lose_requests() {
  LinkConditions& conditions = plant_.conditions_of(some_controller());
  conditions.lost = static_cast<unsigned>(1 + random_.below(30));
  for_a_while([&conditions] { conditions.lost = 0; });
}

void FaultInjector::reset_channel() {
  Controller& controller = *random_.pick(plant_.controllers());
  const Time pause = random_.mostly(Time{}, 20ms, 500ms, 50);
  const auto channel = static_cast<std::uint16_t>(1 + random_.below(controller.size()));
  count_hits([&](const auto&, const fabric::ChannelStatus& status) {
    return status.key == Key{controller.name(), channel};
  });
  controller.reset(channel, pause);
}

void FaultInjector::switch_controller_off() {
  Controller& controller = some_controller();
  if (!controller.powered()) {
    return;
  }
  controller.switch_off();
  if (random_.chance(50)) {
    plant_.cut_links(controller, "connection reset");
  }
  for_a_while([this, &controller] {
    controller.switch_on();
    // Its TCP stack answers the old connection's next segment with a reset.
    plant_.cut_links(controller, "connection reset");
  });
}

}  // namespace millrace::tests::simulation
