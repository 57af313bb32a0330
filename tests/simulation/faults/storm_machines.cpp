// Faults of controllers and of the links to them.
#include "tests/simulation/faults/storm.hpp"

namespace millrace::tests::simulation {

void Storm::cut_link() {
  Controller& controller = some_controller();
  plant_.cut_links(controller, "connection reset");
}

void Storm::silence_link() {
  Controller& controller = some_controller();
  Cable& cable = plant_.cable_of(controller);
  plant_.history().note(controller.name(), "nothing comes through");
  cable.silent = true;
  for_a_while([this, &cable, &controller] {
    plant_.history().note(controller.name(), "all comes through again");
    cable.silent = false;
  });
}

void Storm::slow_link() {
  Controller& controller = some_controller();
  Cable& cable = plant_.cable_of(controller);
  cable.delay_most = random_.mostly(5ms, 200ms, 2500ms, 30);
  cable.delay_least = random_.between(Time{}, cable.delay_most);
  cable.late_until =
      std::max(cable.late_until, plant_.agenda().now() + longest_fault + 2 * cable.delay_most);
  plant_.history().note(controller.name(), "is slow");
  for_a_while([&cable] {
    cable.delay_least = Cable{}.delay_least;
    cable.delay_most = Cable{}.delay_most;
  });
}

void Storm::refuse_requests() {
  Cable& cable = plant_.cable_of(some_controller());
  cable.refused = static_cast<unsigned>(1 + random_.below(50));
  for_a_while([&cable] { cable.refused = 0; });
}

void Storm::lose_requests() {
  Cable& cable = plant_.cable_of(some_controller());
  cable.lost = static_cast<unsigned>(1 + random_.below(30));
  for_a_while([&cable] { cable.lost = 0; });
}

void Storm::reset_channel() {
  Controller& controller = *random_.pick(plant_.controllers());
  const Time pause = random_.mostly(Time{}, 20ms, 500ms, 50);
  const auto channel = static_cast<std::uint16_t>(1 + random_.below(controller.size()));
  befalls([&](const auto&, const fabric::ChannelStatus& status) {
    return status.key == Key{controller.name(), channel};
  });
  controller.reset(channel, pause);
}

void Storm::switch_controller_off() {
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
