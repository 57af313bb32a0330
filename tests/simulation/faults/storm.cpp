#include "tests/simulation/faults/storm.hpp"

#include <array>
#include <utility>

namespace millrace::tests::simulation {

Storm::Storm(World& world, Random random) : world_(world), random_(random) {
  static constexpr std::array all{&Storm::cut_link,
                                  &Storm::silence_link,
                                  &Storm::slow_link,
                                  &Storm::refuse_requests,
                                  &Storm::lose_requests,
                                  &Storm::reset_channel,
                                  &Storm::switch_controller_off,
                                  &Storm::kill_gateway,
                                  &Storm::cut_gateway_power,
                                  &Storm::stop_gateway,
                                  &Storm::freeze_gateway,
                                  &Storm::kill_service,
                                  &Storm::drain_service,
                                  &Storm::freeze_service,
                                  &Storm::fill_disk,
                                  &Storm::step_clock,
                                  &Storm::cut_path,
                                  &Storm::cut_off,
                                  &Storm::lose_samples};
  const auto share = static_cast<unsigned>(10 + random_.below(60));
  for (const Fault fault : all) {
    if (random_.chance(share)) {
      kinds_.push_back(fault);
    }
  }
  if (kinds_.empty()) {
    kinds_.push_back(all[random_.below(all.size())]);
  }
  pause_ = random_.between(20ms, 400ms);
}

void Storm::begin(Time duration) {
  end_ = world_.agenda().now() + duration;
  soon(random_.between(Time{}, pause_), [this] { strike(); });
}

void Storm::soon(Time delay, std::function<void()> act) {
  world_.agenda().after(delay, {}, [this, act = std::move(act)] {
    if (!over_) {
      act();
    }
  });
}

void Storm::for_a_while(std::function<void()> undo) {
  soon(random_.mostly(10ms, 300ms, 3000ms, 30), std::move(undo));
}

void Storm::strike() {
  if (world_.agenda().now() >= end_) {
    return;
  }
  (this->*random_.pick(kinds_))();
  soon(random_.between(Time{}, 2 * pause_), [this] { strike(); });
}

void Storm::end() {
  over_ = true;
  world_.history().note("storm", "is over");
  for (auto& cable : world_.cables()) {
    *cable = Cable{.shuffled = cable->shuffled};
  }
  for (auto& gateway : world_.gateways()) {
    gateway->disk().full = false;
    gateway->thaw();
  }
  for (auto& service : world_.services()) {
    service->thaw();
  }
  for (auto& controller : world_.controllers()) {
    controller->switch_on();
    controller->calm_down();
  }
  world_.fabric().open_all_paths();
  world_.fabric().weather.lost = 0;
}

}  // namespace millrace::tests::simulation
