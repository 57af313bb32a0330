#include "tests/simulation/faults/storm.hpp"

#include <utility>

namespace millrace::tests::simulation {

const std::vector<Storm::Fault>& Storm::all() {
  static const std::vector<Fault> all{
      {"cut-link", &Storm::cut_link},
      {"silence-link", &Storm::silence_link},
      {"slow-link", &Storm::slow_link},
      {"refuse-requests", &Storm::refuse_requests},
      {"lose-requests", &Storm::lose_requests},
      {"reset-channel", &Storm::reset_channel},
      {"switch-controller-off", &Storm::switch_controller_off},
      {"kill-gateway", &Storm::kill_gateway},
      {"cut-gateway-power", &Storm::cut_gateway_power},
      {"stop-gateway", &Storm::stop_gateway},
      {"freeze-gateway", &Storm::freeze_gateway},
      {"kill-service", &Storm::kill_service},
      {"drain-service", &Storm::drain_service},
      {"freeze-service", &Storm::freeze_service},
      {"fill-disk", &Storm::fill_disk},
      {"step-clock", &Storm::step_clock},
      {"cut-path", &Storm::cut_path},
      {"cut-off", &Storm::cut_off},
      {"lose-samples", &Storm::lose_samples},
      {"reload-gateway", &Storm::reload_gateway},
      {"part-gateways", &Storm::part_gateways},
      {"stranger-speaks", &Storm::stranger_speaks},
      {"speak-for-another", &Storm::speak_for_another},
      {"speak-again", &Storm::speak_again},
  };
  return all;
}

std::vector<std::string> Storm::names() {
  std::vector<std::string> names;
  for (const Fault& one : all()) {
    names.emplace_back(one.name);
  }
  return names;
}

Storm::Storm(Plant& plant, Random random) : plant_(plant), random_(random) {
  const auto share = static_cast<unsigned>(10 + random_.below(60));
  for (const Fault& fault : all()) {
    if (random_.chance(share)) {
      kinds_.push_back(fault);
    }
  }
  pause_ = random_.between(20ms, 400ms);
  if (random_.chance(20)) {
    // One or two kinds alone, often.
    kinds_ = {random_.pick(all()), random_.pick(all())};
    pause_ = random_.between(2ms, 60ms);
  }
  if (kinds_.empty()) {
    kinds_.push_back(random_.pick(all()));
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
  const Fault& fault = random_.pick(kinds_);
  if (!plant_.limits().without.contains(std::string(fault.name))) {
    for (const auto& gateway : plant_.gateways()) {
      for (const auto& [key, status] : gateway->statuses()) {
        ++reach_[{std::string(fault.name), status.state}];
      }
    }
    (this->*fault.begin)();
  }
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
