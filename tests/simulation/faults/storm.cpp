#include "tests/simulation/faults/storm.hpp"

#include <array>
#include <utility>

namespace millrace::tests::simulation {

Storm::Storm(Plant& plant, Random random) : plant_(plant), random_(random) {
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
                                  &Storm::lose_samples,
                                  &Storm::reload_gateway,
                                  &Storm::part_gateways,
                                  &Storm::stranger_speaks,
                                  &Storm::speak_for_another,
                                  &Storm::speak_again};
  const auto share = static_cast<unsigned>(10 + random_.below(60));
  for (const Fault fault : all) {
    if (random_.chance(share)) {
      kinds_.push_back(fault);
    }
  }
  pause_ = random_.between(20ms, 400ms);
  if (random_.chance(20)) {
    // One or two kinds alone, often.
    kinds_ = {all[random_.below(all.size())], all[random_.below(all.size())]};
    pause_ = random_.between(2ms, 60ms);
  }
  if (kinds_.empty()) {
    kinds_.push_back(all[random_.below(all.size())]);
  }
}

void Storm::begin(Time duration) {
  end_ = plant_.agenda().now() + duration;
  soon(random_.between(Time{}, pause_), [this] { strike(); });
}

void Storm::soon(Time delay, std::function<void()> act) {
  plant_.agenda().after(delay, {}, [this, act = std::move(act)] {
    if (!over_) {
      act();
    }
  });
}

void Storm::for_a_while(std::function<void()> undo) {
  soon(random_.mostly(10ms, 300ms, 3000ms, 30), std::move(undo));
}

void Storm::strike() {
  if (plant_.agenda().now() >= end_) {
    return;
  }
  (this->*random_.pick(kinds_))();
  soon(random_.between(Time{}, 2 * pause_), [this] { strike(); });
}

void Storm::end() {
  over_ = true;
  plant_.history().note("storm", "is over");
  for (auto& cable : plant_.cables()) {
    *cable = Cable{};
  }
  for (auto& gateway : plant_.gateways()) {
    gateway->disk().full = false;
    gateway->thaw();
    gateway->reload(plant_.first_file(*gateway));
  }
  for (auto& service : plant_.services()) {
    service->thaw();
  }
  for (auto& controller : plant_.controllers()) {
    controller->switch_on();
    controller->calm_down();
  }
  plant_.fabric().open_all_paths();
  plant_.fabric().weather.lost = 0;
}

}  // namespace millrace::tests::simulation
